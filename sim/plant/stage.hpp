#pragma once
// One motorised stage: where its motor is, exactly and at any time, and where its carriage is.

#include "protocols/base/time.hpp"
#include "sim/plant/profile.hpp"

namespace weft::sim {

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
  [[nodiscard]] double position(TimePoint t) const { return profile_.position(since_start_s(t)); }
  [[nodiscard]] double velocity(TimePoint t) const { return profile_.velocity(since_start_s(t)); }
  [[nodiscard]] TimePoint end() const { return end_; }
  [[nodiscard]] const StageParams& params() const { return params_; }

  /// Where the carriage is, for physics. With backlash the path since the last settle() must have
  /// been one-way, or longer than the play.
  [[nodiscard]] double carriage(TimePoint t) const;
  /// Lets the carriage follow up to `t`.
  void settle(TimePoint t) { carriage_ = dragged(t); }

 private:
  [[nodiscard]] double since_start_s(TimePoint t) const { return to_seconds(t - start_); }
  [[nodiscard]] double dragged(TimePoint t) const;
  void adopt(const Profile& profile, TimePoint now);

  StageParams params_;
  Profile profile_;
  TimePoint start_{};
  TimePoint end_{};
  double carriage_;  ///< before the quantum
};

}  // namespace weft::sim
