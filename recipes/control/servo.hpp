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

/// What a stage that is driven with `speed` reaches: it is sent no further than `speed` takes it
/// within the horizon and goes no faster than it can stop by there. All in m or rad, and > 0.
inline double reached_speed(double speed, double acceleration, Duration horizon = servo_horizon) {
  return std::min(speed, std::sqrt(2 * acceleration * speed * to_seconds(horizon)));
}

}  // namespace weft::recipes
