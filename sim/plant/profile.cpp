#include "sim/plant/profile.hpp"

#include <algorithm>
#include <cmath>

namespace weft::sim {

Profile Profile::to_rest(double position, double velocity, double acceleration) {
  const double stop = position + velocity * std::abs(velocity) / (2 * acceleration);
  return to_target(position, velocity, stop, {std::abs(velocity) + 1, acceleration});
}

Profile Profile::to_target(double position, double velocity, double target,
                           const MotionLimits& limits) {
  Profile profile(position);
  profile.velocity_ = velocity;
  profile.target_ = target;
  // Where braking now would end decides which way the rest of the move goes.
  const double a = limits.acceleration;
  const double stop = position + velocity * std::abs(velocity) / (2 * a);
  const double direction = target >= stop ? 1 : -1;
  const double distance = direction * (target - position);  // may be negative: overshoot, come back
  const double v0 = direction * velocity;                   // negative: moving away first
  // Peak of the symmetric move that ends at rest: v^2 = a distance + v0^2/2.
  const double peak = std::sqrt(std::max(0.0, a * distance + v0 * v0 / 2));
  const double cruise = std::min(peak, limits.speed);
  const double change = cruise - v0;
  profile.segments_[0] = {std::abs(change) / a, direction * (change >= 0 ? a : -a)};
  profile.segments_[2] = {cruise / a, -direction * a};
  if (peak > limits.speed) {
    const double run_up = (cruise + v0) / 2 * profile.segments_[0].duration_s;
    const double run_out = cruise * cruise / (2 * a);
    profile.segments_[1] = {std::max(0.0, distance - run_up - run_out) / cruise, 0};
  }
  return profile;
}

double Profile::duration_s() const {
  return segments_[0].duration_s + segments_[1].duration_s + segments_[2].duration_s;
}

double Profile::position(double t_s) const {
  if (t_s >= duration_s()) return target_;
  double position = position_, velocity = velocity_, left = std::max(0.0, t_s);
  for (const Segment& segment : segments_) {
    const double t = std::min(left, segment.duration_s);
    position += velocity * t + 0.5 * segment.acceleration * t * t;
    velocity += segment.acceleration * t;
    left -= t;
  }
  return position;
}

double Profile::velocity(double t_s) const {
  if (t_s >= duration_s()) return 0;
  double velocity = velocity_, left = std::max(0.0, t_s);
  for (const Segment& segment : segments_) {
    const double t = std::min(left, segment.duration_s);
    velocity += segment.acceleration * t;
    left -= t;
  }
  return velocity;
}

}  // namespace weft::sim
