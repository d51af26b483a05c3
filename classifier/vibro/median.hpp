#pragma once
// The median of many numbers without sorting them.

#include <span>
#include <vector>

#include "classifier/base/lanes.hpp"

namespace weft::classifier::vibro {

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
