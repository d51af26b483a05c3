#pragma once
// One motorised stage: where its motor is, exactly and at any time, and where its carriage is.

#include <array>
#include <cstddef>
#include <optional>

#include "protocols/base/time.hpp"

namespace weft::sim {

// A point-to-point move with limited speed and acceleration, in closed form: position and velocity
// at any time, from any initial velocity; from rest with limited jerk too. Works in metres or
// radians. Source: docs/reference/plant.md, Contact law and Closed forms (7).

struct MotionLimits {
  double speed = 1;         ///< [1/s], > 0
  double acceleration = 1;  ///< [1/s2], > 0
  double jerk = 0;          ///< [1/s3]; 0 lets the acceleration jump: a trapezoid of velocity
};

class Profile {
 public:
  /// Stands at `position`.
  explicit Profile(double position = 0) : position_(position), target_(position) {}
  /// From `position` with `velocity` to rest at `target`: brakes, turns round, cruises as needed. A
  /// move too short to reach the speed limit is a triangle. With a jerk limit a move from rest is
  /// an S-curve; one that is re-planned on its way is a trapezoid still.
  static Profile to_target(double position, double velocity, double target,
                           const MotionLimits& limits);
  /// From `velocity` to rest as soon as the acceleration allows.
  static Profile to_rest(double position, double velocity, double acceleration);

  /// `t_s` is counted from the start of the profile; before it and after the end it stands.
  [[nodiscard]] double position(double t_s) const;
  [[nodiscard]] double velocity(double t_s) const;
  [[nodiscard]] double duration_s() const { return duration_s_; }
  /// Where it stands after its end.
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
  double start = 0;       ///< when the power comes on
  double quantum = 1e-6;  ///< the carriage stands on multiples of this; 0 switches it off
  double backlash = 0;    ///< play between motor and carriage; 0 switches it off
};

class Stage {
 public:
  explicit Stage(const StageParams& params)
      : params_(params), profile_(params.start), carriage_(params.start) {}

  /// Plans from where the motor is at `now`, with the velocity it has, to `target` held inside the
  /// travel. Replaces what was planned. `limits` must be positive.
  void move_to(double target, const MotionLimits& limits, TimePoint now);
  /// Brakes with `acceleration`; 0 stops dead.
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

  /// Where the carriage is, for physics. With backlash the path since the last settle() must have
  /// been one-way, or longer than the play.
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
  /// Nothing moves from `end_` to the next plan: the carriage is where it was then.
  [[nodiscard]] bool is_settled(TimePoint t) const { return resting_ && t >= end_; }
  [[nodiscard]] double dragged(TimePoint t) const;
  [[nodiscard]] double quantised(double carriage) const;
  void adopt(const Profile& profile, TimePoint now);

  StageParams params_;
  Profile profile_;
  TimePoint start_{};
  TimePoint end_{};
  double carriage_;                ///< before the quantum
  std::optional<double> resting_;  ///< carriage() from `end_` on, where it is known
};

}  // namespace weft::sim
