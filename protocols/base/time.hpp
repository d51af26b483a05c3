#pragma once
// Time points, durations and unit constants. Time is an argument: pure code receives a TimePoint,
// and only a Loop reads a clock.

#include <chrono>
#include <cstdint>
#include <numbers>

namespace weft {

/// Nanoseconds, as integer ticks, so a long campaign does not drift (docs/reference/plant.md, Time
/// and numbers).
using Duration = std::chrono::nanoseconds;

/// The clock of a Loop: zero at the start of the loop. It has no now(): use the Loop.
struct WeftEpoch {
  using rep = std::int64_t;
  using period = std::nano;
  using duration = Duration;
  using time_point = std::chrono::time_point<WeftEpoch>;
};
using TimePoint = std::chrono::time_point<WeftEpoch, Duration>;

constexpr double to_seconds(Duration d) {
  return std::chrono::duration<double>(d).count();
}
constexpr double to_seconds(TimePoint t) {
  return to_seconds(t.time_since_epoch());
}
constexpr std::int64_t ns_of(TimePoint t) {
  return t.time_since_epoch().count();
}

/// Nearest nanosecond; the caller keeps `seconds` finite and below 292 years.
constexpr Duration from_seconds(double seconds) {
  return Duration(static_cast<std::int64_t>(seconds * 1e9 + (seconds < 0 ? -0.5 : 0.5)));
}

// Unit constants, to convert human units into SI. Names carry units (force_n, speed_mps).

constexpr double m_per_mm = 1e-3;
constexpr double m_per_um = 1e-6;
constexpr double rad_per_deg = std::numbers::pi / 180.0;
constexpr double standard_gravity_mps2 = 9.80665;  // CGPM 1901

}  // namespace weft
