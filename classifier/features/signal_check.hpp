#pragma once
// Defects in the samples of one taxel or channel of one recording.

#include <cstddef>
#include <span>
#include <vector>

namespace weft::classifier {

/// Samples at an end of a signal's range.
struct AtLimit {
  double value = 0.0;
  bool held = false;  ///< longer in a row than other values of a signal that moves
};

struct SignalState {
  bool constant = false;  ///< no spread except rounding
  /// True for a clock or a counter. The signal never falls and mostly rises, or nearly always moves
  /// by one step; it is read at even intervals, or reads each value equally often.
  bool only_rises = false;
  bool only_falls = false;  ///< the same with falling samples
  AtLimit low, high;
  double largest = 0.0;           ///< largest magnitude
  double deviation = 0.0;         ///< root of the mean square deviation from the mean
  double digits = digits_of_all;  ///< decimal digits of the deviation that remain beside the level

  static constexpr double digits_of_all = 15.95;  ///< decimal digits of a double: log10(2^53)
};

/// Checks one signal in the order of time; an empty one is constant. All samples must be finite.
SignalState check_signal(std::span<const double> samples);

/// Below this number of digits the moments of a deviation are unreliable.
inline constexpr double fewest_digits = 6.0;

}  // namespace weft::classifier
