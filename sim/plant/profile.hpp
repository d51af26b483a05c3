#pragma once
// A point-to-point move with limited speed and acceleration, in closed form: position and velocity
// at any time, from any initial velocity; from rest with limited jerk too. Works in metres or
// radians. Source: docs/reference/plant.md, Contact law and Closed forms (7).

#include <array>
#include <cstddef>

namespace weft::sim {

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
  [[nodiscard]] double duration_s() const;

 private:
  struct Segment {
    double duration_s = 0;
    double acceleration = 0;  ///< at its begin
    double jerk = 0;
  };
  static constexpr std::size_t trapezoid_segments = 3;
  static constexpr std::size_t s_curve_segments = 7;

  static Profile s_curve(double position, double target, const MotionLimits& limits);

  double position_;
  double velocity_ = 0;
  double target_;
  std::size_t used_ = trapezoid_segments;
  std::array<Segment, s_curve_segments> segments_{};
};

}  // namespace weft::sim
