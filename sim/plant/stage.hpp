#pragma once
// One motorised stage: the exact position of its motor at any time, and that of its carriage.

#include <array>
#include <cstddef>
#include <optional>

#include "protocols/base/time.hpp"

namespace weft::sim {

// A point-to-point move with limited speed and acceleration, in closed form: position and velocity
// at any time, from any initial velocity; from rest also with limited jerk. Works in metres or
// radians. Source: docs/reference/plant.md, Contact law and Closed forms (7).

struct MotionLimits {
  double speed = 1;         ///< [1/s], > 0
  double acceleration = 1;  ///< [1/s2], > 0
  double jerk = 0;          ///< [1/s3]; 0: the acceleration jumps (trapezoid of velocity)
};

class Profile {
 public:
  /// At rest at `position`.
  explicit Profile(double position = 0) : position_(position), target_(position) {}
  /// From `position` with `velocity` to rest at `target`: brakes, reverses, cruises as needed. A
  /// move too short to reach the speed limit is a triangle. With a jerk limit a move from rest is
  /// an S-curve; a move that is re-planned during motion remains a trapezoid.
  static Profile to_target(double position, double velocity, double target,
                           const MotionLimits& limits);
  /// From `velocity` to rest as soon as the acceleration allows.
  static Profile to_rest(double position, double velocity, double acceleration);

  /// `t_s` is counted from the start of the profile; before it and after the end there is no
  /// motion.
  [[nodiscard]] double position(double t_s) const;
  [[nodiscard]] double velocity(double t_s) const;
  [[nodiscard]] double duration_s() const { return duration_s_; }
  /// Position after the end.
  [[nodiscard]] double target() const { return target_; }

 private:
  struct Segment {
    double duration_s = 0;
    double acceleration = 0;  ///< at its begin
    double jerk = 0;
  };
  struct Moving {
    double position, velocity;
  };
  [[nodiscard]] Moving at(double t_s) const;  ///< before the end
  static constexpr std::size_t trapezoid_segments = 3;
  static constexpr std::size_t s_curve_segments = 7;

  void sum_up();  ///< sets `duration_s_` from the segments
  static Profile s_curve(double position, double target, const MotionLimits& limits);

  double position_;
  double velocity_ = 0;
  double target_;
  std::size_t used_ = trapezoid_segments;
  std::array<Segment, s_curve_segments> segments_{};
  double duration_s_ = 0;
};

/// [m] or [rad].
struct StageParams {
  double low = 0;  ///< travel
  double high = 0;
  double start = 0;       ///< position at power-on
  double quantum = 1e-6;  ///< the carriage moves in multiples of this; 0: continuously
  double backlash = 0;    ///< play between motor and carriage; 0: none
};

class Stage {
 public:
  explicit Stage(const StageParams& params)
      : params_(params), profile_(params.start), carriage_(params.start) {}

  /// Plans a move from the motor's position and velocity at `now` to `target`, limited to the
  /// travel. Replaces the former plan. `limits` must be positive.
  void move_to(double target, const MotionLimits& limits, TimePoint now);
  /// Brakes with `acceleration`; 0 stops at once.
  void stop(double acceleration, TimePoint now);

  /// Motor position and velocity, for controllers.
  [[nodiscard]] double position(TimePoint t) const {
    return t >= end_ ? profile_.target() : profile_.position(since_start_s(t));
  }
  [[nodiscard]] double velocity(TimePoint t) const {
    return t >= end_ ? 0 : profile_.velocity(since_start_s(t));
  }
  [[nodiscard]] TimePoint end() const { return end_; }
  [[nodiscard]] const StageParams& params() const { return params_; }

  /// Position of the carriage, for physics. With backlash the path since the last settle() must
  /// have been one-way, or longer than the play.
  [[nodiscard]] double carriage(TimePoint t) const {
    return is_settled(t) ? *resting_ : quantised(dragged(t));
  }
  /// Lets the carriage follow up to `t`.
  void settle(TimePoint t) {
    if (is_settled(t)) return;
    carriage_ = dragged(t);
    if (t >= end_) resting_ = quantised(carriage_);
  }

 private:
  [[nodiscard]] double since_start_s(TimePoint t) const { return to_seconds(t - start_); }
  /// Nothing moves between `end_` and the next plan: the carriage keeps its position.
  [[nodiscard]] bool is_settled(TimePoint t) const { return resting_ && t >= end_; }
  [[nodiscard]] double dragged(TimePoint t) const;
  [[nodiscard]] double quantised(double carriage) const;
  void adopt(const Profile& profile, TimePoint now);

  StageParams params_;
  Profile profile_;
  TimePoint start_{};
  TimePoint end_{};
  double carriage_;                ///< before quantisation
  std::optional<double> resting_;  ///< carriage() from `end_` on, if known
};

}  // namespace weft::sim
