#pragma once
// Random effects nested in one another, groups of unequal sizes: Henderson's first method (1953),
// sums of squares of group means about those of the next wider group.

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace weft::daemon::calibration {

constexpr std::size_t nested_levels = 3;

/// One observation of several channels.
struct NestedValue {
  /// Widest first: the fixed group, whose means are free, and two random ones. Numbers are unique
  /// within the wider group only.
  std::array<std::size_t, nested_levels> group;
  std::vector<double> values;  ///< [channel]
};

/// Standard deviations (root mean square over channels), absent where no group has two members.
struct NestedSpread {
  std::optional<double> outer;   ///< of the second groups within the fixed one
  std::optional<double> inner;   ///< of the third within the second
  std::optional<double> within;  ///< of observations within the third
};

/// A negative estimate of a variance is 0. Where `within` is absent `inner` contains it.
NestedSpread nested_spread(const std::vector<NestedValue>& observations);

}  // namespace weft::daemon::calibration
