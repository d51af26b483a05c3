#include "sim/plant/stage.hpp"

#include <algorithm>
#include <cmath>

#include "sim/plant/round.hpp"

namespace weft::sim {

void Stage::adopt(const Profile& profile, TimePoint now) {
  settle(now);
  resting_.reset();
  profile_ = profile;
  start_ = now;
  // One tick later than the rounded end, so that the profile has certainly ended.
  end_ = profile.duration_s() > 0 ? now + from_seconds(profile.duration_s()) + Duration(1) : now;
}

void Stage::move_to(double target, const MotionLimits& limits, TimePoint now) {
  const double inside = std::clamp(target, params_.low, params_.high);
  adopt(Profile::to_target(position(now), velocity(now), inside, limits), now);
}

void Stage::stop(double acceleration, TimePoint now) {
  if (acceleration > 0)
    adopt(Profile::to_rest(position(now), velocity(now), acceleration), now);
  else
    adopt(Profile(position(now)), now);
}

double Stage::dragged(TimePoint t) const {
  const double motor = position(t), half_play = params_.backlash / 2;
  return std::clamp(carriage_, motor - half_play, motor + half_play);
}

double Stage::quantised(double carriage) const {
  return params_.quantum > 0 ? params_.quantum * nearest_whole(carriage / params_.quantum)
                             : carriage;
}

Profile Profile::to_rest(double position, double velocity, double acceleration) {
  const double stop = position + velocity * std::abs(velocity) / (2 * acceleration);
  return to_target(position, velocity, stop, {std::abs(velocity) + 1, acceleration});
}

Profile Profile::to_target(double position, double velocity, double target,
                           const MotionLimits& limits) {
  if (limits.jerk > 0 && velocity == 0) return s_curve(position, target, limits);
  Profile profile(position);
  profile.velocity_ = velocity;
  profile.target_ = target;
  // The end of braking now determines the direction of the rest of the move.
  const double a = limits.acceleration;
  const double stop = position + velocity * std::abs(velocity) / (2 * a);
  const double direction = target >= stop ? 1 : -1;
  const double distance = direction * (target - position);  // may be negative: overshoot and return
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
  profile.sum_up();
  return profile;
}

/// Seven segments of constant jerk: the acceleration rises for `jerk_s` and is back at zero after
/// `ramp_s`. The deceleration mirrors the acceleration.
Profile Profile::s_curve(double position, double target, const MotionLimits& limits) {
  Profile profile(position);
  profile.target_ = target;
  profile.used_ = s_curve_segments;
  const double distance = std::abs(target - position), direction = target < position ? -1 : 1;
  const double v = limits.speed, a = limits.acceleration, j = limits.jerk;
  double jerk_s = std::min(a / j, std::sqrt(v / j));
  double ramp_s = jerk_s + (v * j >= a * a ? v / a : jerk_s);
  if (distance < v * ramp_s) {  // too short for the speed, possibly also for the acceleration
    jerk_s = std::min(a / j, std::cbrt(distance / (2 * j)));
    ramp_s = jerk_s < a / j ? 2 * jerk_s
                            : 0.5 * jerk_s + std::sqrt(0.25 * jerk_s * jerk_s + distance / a);
  }
  const double peak = j * jerk_s, hold_s = std::max(0.0, ramp_s - 2 * jerk_s);
  const double cruise_s = std::max(0.0, distance / v - ramp_s);
  profile.segments_ = {{{jerk_s, 0, j},
                        {hold_s, peak, 0},
                        {jerk_s, peak, -j},
                        {cruise_s, 0, 0},
                        {jerk_s, 0, -j},
                        {hold_s, -peak, 0},
                        {jerk_s, -peak, j}}};
  for (Segment& segment : profile.segments_) {
    segment.acceleration *= direction;
    segment.jerk *= direction;
  }
  profile.sum_up();
  return profile;
}

void Profile::sum_up() {
  for (const Segment& segment : segments_) duration_s_ += segment.duration_s;
}

double Profile::position(double t_s) const {
  return t_s >= duration_s() ? target_ : at(t_s).position;
}

double Profile::velocity(double t_s) const {
  return t_s >= duration_s() ? 0 : at(t_s).velocity;
}

Profile::Moving Profile::at(double t_s) const {
  double position = position_, velocity = velocity_, left = std::max(0.0, t_s);
  for (std::size_t i = 0; i < used_ && left > 0; ++i) {
    const Segment& segment = segments_[i];
    const double t = std::min(left, segment.duration_s);
    position += velocity * t + 0.5 * segment.acceleration * t * t + segment.jerk * t * t * t / 6;
    velocity += segment.acceleration * t + 0.5 * segment.jerk * t * t;
    left -= t;
  }
  return {position, velocity};
}

}  // namespace weft::sim
