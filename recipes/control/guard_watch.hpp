#pragma once
// What single readings cannot show: values that stopped changing, that jump, stages that move
// faster than they can or not where they were sent. Pure; one step per scan cycle.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "recipes/control/guards.hpp"

namespace weft::recipes {

struct WatchLimits {
  double wrench_jump_n = 0;  ///< between readings that follow each other; 0: not looked at
  double landing_n = 0;      ///< along z, that a probe puts on the cloth or takes off it at once
  Duration wrench_gap{};     ///< readings further apart may differ by anything
  std::array<double, axis_count> max_speed{};         ///< [m/s] or [rad/s]; 0: not looked at
  std::array<double, axis_count> max_acceleration{};  ///< [m/s2] or [rad/s2], > 0
  Duration order_age{};                               ///< of velocities, see servo.hpp
};

/// The newest frame of a tactile array.
struct TaxelReading {
  std::uint32_t digest = 0;  ///< CRC-32 of the counts
  std::optional<TimePoint> at;
};

/// One cycle's view of the bench.
struct WatchInput {
  std::array<double, 3> force_n{};
  std::array<double, 3> torque_nm{};
  std::optional<TimePoint> wrench_at;
  std::span<const TaxelReading> taxels;  ///< array by array
  Joints position;
  std::array<std::optional<TimePoint>, axis_count> stage_at{};
  bool zero_moves = false;  ///< the sensor is taking its zero: its readings may jump
  bool can_land = false;    ///< z goes down: the probe may come to lie on the cloth
  bool can_lift = false;    ///< z goes up off the cloth, and the probe may leave it
};

class GuardWatch {
 public:
  explicit GuardWatch(const WatchLimits& limits) : limits_(limits) {}

  /// `axis` has been sent from `from` to `target` with `speed` at `now`.
  void moved(Axis axis, double from, double target, double speed, TimePoint now);
  /// `axis` has been given `velocity` at `now`, which ends by itself after `horizon`.
  void driven(Axis axis, double velocity, Duration horizon, TimePoint now);
  /// Nothing is asked of `axis` any more; one that was driven comes to rest along its ramp.
  void released(Axis axis, TimePoint now);

  GuardHistory step(const WatchInput& input, TimePoint now);

 private:
  struct Plan {
    bool moving = false;  ///< a move to a target
    double from = 0, target = 0, speed = 0;
    TimePoint since{};
    bool driven = false;    ///< velocities, cycle by cycle; `speed` is what the last one comes to
    bool released = false;  ///< and comes to rest
    TimePoint until{};      ///< when it ends by itself
    double pace = 0;        ///< velocity of a stage that does as it is told, along its ramps
    double lead = 0;        ///< way of that stage less way covered, slowly forgotten
    double peak_speed = 0;  ///< of the velocities; forgotten alike
    double past_speed = 0;  ///< the same before it was released last
    std::optional<double> seen_at;
  };
  struct Reading {
    std::array<double, 6> value{};
    TimePoint at{};
  };

  void check_wrench(const WatchInput& input);
  /// The cloth has taken the probe's weight over, or given it back.
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
  std::vector<TaxelsSeen> taxels_;                        ///< array by array
  std::array<std::optional<Reading>, axis_count> stage_;  ///< value[0] is its position
  std::array<double, axis_count> excess_{};               ///< way that its speed does not explain
  std::array<Plan, axis_count> plans_{};
};

}  // namespace weft::recipes
