#pragma once
// The median of many numbers without sorting them.

#include <cstdint>
#include <span>
#include <vector>

namespace weft::classifier::vibro {

/// Counts values into cells between the smallest and the largest, then looks into the middle cell
/// alone. Keeps its tables between calls.
class MedianFinder {
 public:
  /// The middle value, or the mean of both middle ones; 0 of none. All finite.
  double median(std::span<const double> values);

 private:
  // The value of that rank, and the next one where `next` is asked for.
  struct Pair {
    double at = 0.0, next = 0.0;
  };
  Pair by_counting(std::span<const double> values, std::size_t rank);

  std::vector<std::uint32_t> count_;
  std::vector<double> candidates_;
};

}  // namespace weft::classifier::vibro
