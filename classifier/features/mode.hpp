#pragma once
// The most frequent value of a signal.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "classifier/base/lanes.hpp"

namespace weft::classifier {

/// Finds the modes of sixteen signals, or two, by counting; sorts only where values are too far
/// apart to be counts of a sensor. Keeps its tables between calls.
class ModeFinder {
 public:
  static constexpr std::size_t signals = simd::block_taxels;
  using Values = std::array<double, signals>;

  /// Most frequent value on a grid of `bin` > 0, the smallest of several (as MATLAB's mode). `rows`
  /// [count x width], count >= 1, width 16 or 2, with the smallest and largest value of every
  /// signal.
  Values find(const double* rows, std::size_t width, std::size_t count, const Values& low,
              const Values& high, double bin);

 private:
  double by_sorting(const double* column, std::size_t width, std::size_t count, double bin);

  std::vector<std::uint32_t> table_;  // one count per value and signal
  std::vector<double> sorted_;
};

}  // namespace weft::classifier
