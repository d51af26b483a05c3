#pragma once
// Of the samples of a window: sums, eight side by side, and the median without sorting.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/base/lanes.hpp"

namespace weft::classifier::vibro {

/// A sample whose magnitude is not above this has no sign: librosa's threshold.
inline constexpr double zero_level = 1e-10;

/// Eight running sums: fast, and nearer to the true sum than one.
double sum_of(std::span<const double> values);
/// Of (value - middle)^2, likewise.
double sum_of_squares(std::span<const double> values, double middle = 0.0);

/// Mean, and the root of the mean square of the deviations from it.
struct Level {
  double mean = 0.0, deviation = 0.0;
};
/// Of at least one value; in two passes where one would lose digits of the deviation.
Level level_of(std::span<const double> values);

/// How many values are negative, below -zero_level, where the one before is not, or the other way
/// round. The first has none before it.
std::size_t changes_of_sign(std::span<const double> values);
/// |value - middle| of each, to `out`, which holds as many.
void deviations(std::span<const double> values, double middle, double* out);

/// Counts the values below a pivot, many side by side, and moves the pivot to where the middle one
/// must be, until few values are left between the bounds; those are picked out. Rounding to single
/// precision keeps the order, so that counting goes over half the memory; where it leaves too many
/// values alike, double precision counts on. Keeps its memory between calls.
class MedianFinder {
 public:
  /// The middle value, or the mean of both middle ones; 0 of none. All finite.
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
