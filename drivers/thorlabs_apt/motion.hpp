#pragma once
// The motion under way, and when it counts as done: the device says so and the position agrees.

#include <cstdint>
#include <cstdlib>
#include <optional>

#include "protocols/base/time.hpp"

namespace weft::drivers {

/// What a status message says, whichever family it is from.
struct StageReading {
  std::int32_t position_counts = 0;
  std::uint32_t status_bits = 0;
  std::int32_t encoder_counts = 0;  ///< steppers only
};

enum class MotionKind : std::uint8_t { none, home, move, servo };

struct Motion {
  MotionKind kind = MotionKind::none;
  std::uint32_t id = 0;
  std::int32_t target_counts = 0;
  bool reported = false;  ///< the device sent MOVE_COMPLETED or MOVE_HOMED

  // Progress: where the stage was when it last moved, and when.
  std::int32_t progress_counts = 0;
  TimePoint progress_at{};
  bool moved = false;  ///< the position was seen to change

  // At rest by its status: at its target without a report, or reported and away from it.
  std::optional<TimePoint> silent_since, away_since;

  [[nodiscard]] bool awaited() const {
    return kind == MotionKind::move || kind == MotionKind::home;
  }
  [[nodiscard]] bool at_target(std::int32_t position_counts, std::int32_t tolerance_counts) const {
    return std::llabs(std::int64_t{position_counts} - target_counts) <= tolerance_counts;
  }
  void note_progress(std::int32_t position_counts, TimePoint at) {
    if (position_counts == progress_counts) return;
    progress_counts = position_counts;
    progress_at = at;
    moved = true;
  }
};

/// What a stage that is under way does before it turns to another target.
struct Braking {
  double way = 0;
  double time_s = 0;
};

/// From `speed`, for `unheard` of which the command has not reached it. In SI.
constexpr Braking braking(double speed, double acceleration, Duration unheard) {
  const double ramp_s = speed / acceleration;
  return {speed * (to_seconds(unheard) + 0.5 * ramp_s), to_seconds(unheard) + ramp_s};
}

/// How long a trapezoidal move over `distance` may take: its ideal time d/v + v/a, half as much
/// again, and two seconds for the controller to settle. What the stage brakes before may lead it
/// away from its target. Arguments are positive, in SI.
constexpr Duration move_time_limit(double distance, double speed, double acceleration,
                                   const Braking& before = {}) {
  const double way_s = (distance + before.way) / speed;
  return from_seconds(1.5 * (before.time_s + way_s + speed / acceleration) + 2.0);
}

}  // namespace weft::drivers
