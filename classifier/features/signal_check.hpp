#pragma once
// What is wrong with the samples of one taxel or channel of one recording.

#include <cstddef>
#include <span>
#include <vector>

namespace weft::classifier {

/// Samples at an end of a signal's range.
struct AtLimit {
  double value = 0.0;
  bool held = false;  ///< too long in a row for a signal that moves through its other values
};

struct SignalState {
  bool constant = false;  ///< no spread but rounding
  /// Never falls and mostly rises, or nearly always by one step, read at even intervals or each
  /// value equally often: a clock or a counter.
  bool only_rises = false;
  bool only_falls = false;  ///< the same downwards
  AtLimit low, high;
  double largest = 0.0;           ///< magnitude
  double deviation = 0.0;         ///< root of the mean square deviation from the mean
  double digits = digits_of_all;  ///< that the level leaves to the deviation

  static constexpr double digits_of_all = 15.95;  ///< of a double: log10(2^53)
};

/// Of one signal in the order of time; of none constant. All samples finite.
SignalState check_signal(std::span<const double> samples);

/// Below this number of digits moments of a deviation mean little.
inline constexpr double fewest_digits = 6.0;

}  // namespace weft::classifier
