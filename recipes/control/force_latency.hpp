#pragma once
// Delay of the force readings: the lag at which changes of the force best follow changes of the
// stage position. Pure. It explains why a step did not reach its force.

#include <cstddef>
#include <optional>
#include <vector>

namespace weft::recipes {

/// Keeps the last `memory_s` of a press, one pair of values per scan cycle.
class ForceLatency {
 public:
  static constexpr double memory_s = 4;
  static constexpr double longest_s = 0.5;  ///< largest lag of the search
  /// Least correlation of the changes for a lag to be reported.
  static constexpr double least_correlation = 0.4;

  /// `cycle_s`: time between two calls of add().
  explicit ForceLatency(double cycle_s);

  /// z [m], counted downwards, and the normal force [N] as read in the same cycle.
  void add(double z_m, double force_n);

  /// Delay from the stage's motion to its force in the readings [s], accurate to half a cycle.
  /// Nullopt if the stage moved too little or the force does not follow it.
  [[nodiscard]] std::optional<double> estimate_s() const;

 private:
  struct Pair {
    double z_m = 0, force_n = 0;
  };
  [[nodiscard]] std::vector<Pair> changes() const;

  double cycle_s_;
  std::size_t capacity_;
  std::size_t next_ = 0;  ///< index of the oldest pair once the memory is full
  std::vector<Pair> values_;
};

}  // namespace weft::recipes
