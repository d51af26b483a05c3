#pragma once
// Detects faults that one reading cannot show: values that do not change or that jump, and stages
// that are too fast or not at their commanded position. Pure; one step per scan cycle.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "recipes/control/guards.hpp"

namespace weft::recipes {

struct WatchLimits {
  double wrench_jump_n = 0;  ///< between consecutive readings; 0: not checked
  double landing_n = 0;      ///< change along z when the probe lands on the fabric or leaves it
  Duration wrench_gap{};     ///< readings further apart than this are not compared
  std::array<double, axis_count> max_speed{};         ///< [m/s] or [rad/s]; 0: not checked
  std::array<double, axis_count> max_acceleration{};  ///< [m/s2] or [rad/s2], > 0
  Duration order_age{};                               ///< age of velocity commands, see servo.hpp
};

/// The newest frame of a tactile array.
struct TaxelReading {
  std::uint32_t digest = 0;  ///< CRC-32 of the counts
  std::optional<TimePoint> at;
};

/// Readings of the bench in one cycle.
struct WatchInput {
  std::array<double, 3> force_n{};
  std::array<double, 3> torque_nm{};
  std::optional<TimePoint> wrench_at;
  std::span<const TaxelReading> taxels;  ///< one per array
  Joints position;
  std::array<std::optional<TimePoint>, axis_count> stage_at{};
  bool zero_moves = false;  ///< the bias is being taken, so the readings may jump
  bool can_land = false;    ///< z moves down: the probe may land on the fabric
  bool can_lift = false;    ///< z moves up: the probe may leave the fabric
};

class GuardWatch {
 public:
  explicit GuardWatch(const WatchLimits& limits) : limits_(limits) {}

  /// Records that `axis` was commanded from `from` to `target` with `speed` at `now`.
  void moved(Axis axis, double from, double target, double speed, TimePoint now);
  /// Records that `axis` was commanded `velocity` at `now`; it ends by itself after `horizon`.
  void driven(Axis axis, double velocity, Duration horizon, TimePoint now);
  /// Ends the commands of `axis`; a driven axis comes to rest along its ramp.
  void released(Axis axis, TimePoint now);

  GuardHistory step(const WatchInput& input, TimePoint now);

 private:
  struct Plan {
    bool moving = false;  ///< moves to a target
    double from = 0, target = 0, speed = 0;
    TimePoint since{};
    bool driven = false;    ///< commanded by velocities, cycle by cycle; `speed` is the resulting
                            ///< speed of the last one
    bool released = false;  ///< driven before, now coming to rest
    TimePoint until{};      ///< when the velocity ends by itself
    double pace = 0;        ///< velocity of an ideal stage along its ramps
    double lead = 0;        ///< way of the ideal stage minus way covered; decays slowly
    double peak_speed = 0;  ///< largest velocity; decays at the same rate
    double past_speed = 0;  ///< largest velocity before the last release
    std::optional<double> seen_at;
  };
  struct Reading {
    std::array<double, 6> value{};
    TimePoint at{};
  };

  void check_wrench(const WatchInput& input);
  /// Whether the fabric has just taken over the probe's weight or returned it.
  [[nodiscard]] bool is_landing(const Reading& now, const WatchInput& input) const;
  void check_taxels(const WatchInput& input);
  void check_speed(Axis axis, double position, TimePoint at);
  void integrate(Axis axis, TimePoint now);
  [[nodiscard]] double lag(Axis axis, double position, TimePoint now);
  [[nodiscard]] double lag_allowed(Axis axis) const;

  WatchLimits limits_;
  GuardHistory seen_;
  std::optional<Reading> wrench_;  ///< the newest
  std::optional<Reading> believed_;
  TimePoint wrench_changed_{};
  struct TaxelsSeen {
    TaxelReading newest;
    TimePoint changed{};
  };
  std::vector<TaxelsSeen> taxels_;                        ///< one per array
  std::array<std::optional<Reading>, axis_count> stage_;  ///< value[0] is its position
  std::array<double, axis_count> excess_{};  ///< way that the top speed does not explain
  std::array<Plan, axis_count> plans_{};
};

}  // namespace weft::recipes
