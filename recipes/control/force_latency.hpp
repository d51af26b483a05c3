#pragma once
// How late the readings of the force come: the lag at which changes of the force follow changes of
// the stage's position best. Pure; for a step that did not reach its force, to say why.

#include <cstddef>
#include <optional>
#include <vector>

namespace weft::recipes {

/// Keeps the last `memory_s` of a press, one pair of values a scan cycle.
class ForceLatency {
 public:
  static constexpr double memory_s = 4;
  static constexpr double longest_s = 0.5;  ///< lags beyond are not looked for
  /// Least correlation of the changes for which a lag is named.
  static constexpr double least_correlation = 0.4;

  /// `cycle_s`: between two calls of add().
  explicit ForceLatency(double cycle_s);

  /// z [m], counted downwards, and the normal force [N] as read in the same cycle.
  void add(double z_m, double force_n);

  /// [s], from the stage's motion to its force in the readings, to half a cycle. Nothing where the
  /// stage moved too little, or the force does not follow it.
  [[nodiscard]] std::optional<double> estimate_s() const;

 private:
  struct Pair {
    double z_m = 0, force_n = 0;
  };
  [[nodiscard]] std::vector<Pair> changes() const;

  double cycle_s_;
  std::size_t capacity_;
  std::size_t next_ = 0;  ///< the oldest, once the memory is full
  std::vector<Pair> values_;
};

}  // namespace weft::recipes
