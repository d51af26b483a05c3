#pragma once
// Statistics of the samples of a window: sums, eight side by side, and the median without sorting.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/base/lanes.hpp"

namespace weft::classifier::vibro {

/// A sample with a magnitude up to this has no sign: librosa's threshold.
inline constexpr double zero_level = 1e-10;

/// Eight running sums: fast, and more accurate than one.
double sum_of(std::span<const double> values);
/// Sum of (value - middle)^2, with eight running sums.
double sum_of_squares(std::span<const double> values, double middle = 0.0);

/// Mean, and the root of the mean square of the deviations from it.
struct Level {
  double mean = 0.0, deviation = 0.0;
};
/// Needs at least one value. Uses two passes if one would lose digits of the deviation.
Level level_of(std::span<const double> values);

/// Number of changes between negative (below -zero_level) and other values. The first value has
/// none before it.
std::size_t changes_of_sign(std::span<const double> values);
/// |value - middle| of each value to `out`, of the same size.
void deviations(std::span<const double> values, double middle, double* out);

/// Finds a median by counting. It counts the values below a pivot, many side by side, and moves the
/// pivot until few values are left between the bounds; the result is selected among these. Rounding
/// to single precision keeps the order, so counting reads half the memory. If too many rounded
/// values are equal, it continues in double precision. Keeps its memory between calls.
class MedianFinder {
 public:
  /// The middle value, or the mean of both middle ones; 0 for an empty list. All finite.
  double median(std::span<const double> values);

 private:
  // The value of a rank, and the one after it.
  struct Pair {
    double at = 0.0, next = 0.0;
  };
  Pair ranked(std::span<const double> values, std::size_t rank);

  std::vector<float, simd::LineAllocator<float>> rounded_;
  std::vector<double> picked_;
};

}  // namespace weft::classifier::vibro
