#pragma once
// The median of many numbers without sorting them.

#include <span>
#include <vector>

namespace weft::classifier::vibro {

/// Counts the values below a pivot, eight side by side, and moves the pivot to where the middle
/// one must be, until few values are left between the bounds. Keeps its memory between calls.
class MedianFinder {
 public:
  /// The middle value, or the mean of both middle ones; 0 of none. All finite.
  double median(std::span<const double> values);

 private:
  // The value of a rank, and the one after it.
  struct Pair {
    double at = 0.0, next = 0.0;
  };
  Pair among(std::span<const double> values, double low, double high, std::size_t place);
  Pair by_counting(std::span<const double> values, std::size_t rank);

  std::vector<double> picked_;
};

}  // namespace weft::classifier::vibro
