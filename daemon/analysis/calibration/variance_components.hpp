#pragma once
// Nested random effects with groups of unequal sizes, by Henderson's first method (1953): sums of
// squares of group means about those of the next wider group.

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace weft::daemon::calibration {

constexpr std::size_t nested_levels = 3;

/// One observation of several channels.
struct NestedValue {
  /// Widest first: the fixed group, with free means, and two random ones. Numbers are unique only
  /// within the wider group.
  std::array<std::size_t, nested_levels> group;
  std::vector<double> values;  ///< [channel]
};

/// Standard deviations (root mean square over channels), absent if no group has two members.
struct NestedSpread {
  std::optional<double> outer;   ///< second groups within the fixed one
  std::optional<double> inner;   ///< third groups within the second
  std::optional<double> within;  ///< observations within the third
};

/// A negative estimate of a variance is 0. If `within` is absent, `inner` includes it.
NestedSpread nested_spread(const std::vector<NestedValue>& observations);

}  // namespace weft::daemon::calibration
