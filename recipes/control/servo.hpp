#pragma once
// A stage that is driven by velocities that end by themselves, sent again in each cycle
// (docs/adr/0002).

#include <algorithm>
#include <chrono>
#include <cmath>

#include "protocols/base/time.hpp"

namespace weft::recipes {

/// A velocity ends after this time, whatever the rate of the cycle.
inline constexpr Duration servo_horizon = std::chrono::milliseconds(100);

/// How old the reading is, in the middle, from which an order is counted that is sent again in each
/// cycle: it is of the cycle before, and the order stands for a cycle.
inline Duration order_age(double cycle_hz) {
  return from_seconds(1.5 / cycle_hz);
}

/// What a stage that is driven with `speed` reaches: it is sent no further than `speed` takes it
/// within the horizon from where it was `age` ago, and goes no faster than it can stop by there.
/// All in m or rad, and > 0.
inline double reached_speed(double speed, double acceleration, Duration age,
                            Duration horizon = servo_horizon) {
  const double way = speed * to_seconds(horizon);
  const double lost = acceleration * to_seconds(age);
  // The positive v of v^2 / 2a = way - v age.
  const double reached =
      2 * acceleration * way / (lost + std::sqrt(lost * lost + 2 * acceleration * way));
  return std::min(speed, reached);
}

/// How far a stage that is driven with `speed` [m/s] may still go after the reading at which it was
/// told to stop or to turn [m]: to the end of the last order, by which it can stop.
inline double run_on_m(double speed) {
  return speed * to_seconds(servo_horizon);
}

}  // namespace weft::recipes
