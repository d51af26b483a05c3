#pragma once
// Drives a stage by velocities that end by themselves and are sent again in each cycle
// (docs/adr/0002).

#include <algorithm>
#include <chrono>
#include <cmath>

#include "protocols/base/time.hpp"

namespace weft::recipes {

/// A velocity ends after this time at any cycle rate.
inline constexpr Duration servo_horizon = std::chrono::milliseconds(100);

/// Mean age of the reading from which a repeated command is counted. The reading is from the cycle
/// before, and the command is valid for one cycle.
inline Duration order_age(double cycle_hz) {
  return from_seconds(1.5 / cycle_hz);
}

/// Speed that a stage reaches when driven with `speed`. It is sent no further than `speed` takes it
/// within the horizon, counted from its position `age` ago. It goes no faster than it can stop by
/// there. All in m or rad, and > 0.
inline double reached_speed(double speed, double acceleration, Duration age,
                            Duration horizon = servo_horizon) {
  const double way = speed * to_seconds(horizon);
  const double lost = acceleration * to_seconds(age);
  // The positive v of v^2 / 2a = way - v age.
  const double reached =
      2 * acceleration * way / (lost + std::sqrt(lost * lost + 2 * acceleration * way));
  return std::min(speed, reached);
}

/// Largest way after the reading that caused a stop or reversal, at `speed` [m/s]; result in m. The
/// stage can stop by the end of the last command.
inline double run_on_m(double speed) {
  return speed * to_seconds(servo_horizon);
}

}  // namespace weft::recipes
