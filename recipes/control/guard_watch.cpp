#include "recipes/control/guard_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "recipes/control/servo.hpp"

namespace weft::recipes {
namespace {

/// A report may exceed the top speed by this factor without limit of time.
constexpr double speed_tolerance = 1.1;
/// Allowed delay of a report after timely ones: a stall of the host or link looks like speed [s]. A
/// guard of the host covers longer stalls.
constexpr double speed_reserve_s = 0.25;
/// The same for a commanded move, which begins and is reported later [s].
constexpr double following_reserve_s = 0.3;
/// Distance that is never an error: backlash, in-position windows, a step of the force loop.
constexpr double following_slack_m = 0.2e-3;
constexpr double following_slack_rad = 2e-3;
/// Velocities commanded earlier than this no longer count [s].
constexpr double driven_memory_s = 0.5;
/// Allowed lag of a stage behind its velocities: latency and ramp [s], at least the latency, and a
/// distance for rounding.
constexpr double driven_reserve_s = 0.3;
constexpr double driven_latency_s = 0.1;
constexpr double driven_slack_m = 20e-6;
/// Delay with which a stage receives a command to stop or slow down [s].
constexpr double braking_latency_s = 0.075;

std::array<double, 6> joined(const WatchInput& input) {
  return {input.force_n[0],   input.force_n[1],   input.force_n[2],
          input.torque_nm[0], input.torque_nm[1], input.torque_nm[2]};
}

struct Ramped {
  double way = 0;
  double pace = 0;
};

/// Accelerates from `pace` to `speed` along the ramp, then continues at `speed`, for `time_s`.
Ramped ramped(double pace, double speed, double acceleration, double time_s) {
  const double ramp_s = std::min(time_s, std::abs(speed - pace) / acceleration);
  const double then = pace + std::copysign(acceleration * ramp_s, speed - pace);
  return {0.5 * (pace + then) * ramp_s + speed * (time_s - ramp_s), then};
}

double distance(const std::array<double, 6>& a, const std::array<double, 6>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

}  // namespace

void GuardWatch::moved(Axis axis, double from, double target, double speed, TimePoint now) {
  Plan plan;
  plan.moving = true;
  plan.from = from;
  plan.target = target;
  plan.speed = speed;
  plan.since = now;
  plans_[index(axis)] = plan;
}

void GuardWatch::driven(Axis axis, double velocity, Duration horizon, TimePoint now) {
  Plan& plan = plans_[index(axis)];
  if (!plan.driven) {
    plan = {};
    plan.driven = true;
    plan.since = now;
  }
  integrate(axis, now);
  if (std::exchange(plan.released, false)) {
    plan.past_speed = std::max(plan.past_speed, std::exchange(plan.peak_speed, 0));
    plan.lead = 0;
  }
  const double acceleration = limits_.max_acceleration[index(axis)];
  const double speed = reached_speed(std::abs(velocity), acceleration, limits_.order_age, horizon);
  plan.speed = std::copysign(speed, velocity);
  plan.peak_speed = std::max(plan.peak_speed, speed);
  plan.until = now + horizon;
}

void GuardWatch::released(Axis axis, TimePoint now) {
  Plan& plan = plans_[index(axis)];
  if (!plan.driven) {
    plan = {};
    return;
  }
  integrate(axis, now);
  plan.released = true;
  plan.until = now;
}

// Adds the commanded motion since the last call to the lead, which decays over time.
void GuardWatch::integrate(Axis axis, TimePoint now) {
  Plan& plan = plans_[index(axis)];
  const double elapsed_s = to_seconds(now - plan.since);
  const double driven_s = std::clamp(to_seconds(plan.until - plan.since), 0.0, elapsed_s);
  const double retained = std::exp(-elapsed_s / driven_memory_s);
  const double acceleration = limits_.max_acceleration[index(axis)];
  const Ramped driven = ramped(plan.pace, plan.speed, acceleration, driven_s);
  const Ramped stopping = ramped(driven.pace, 0, acceleration, elapsed_s - driven_s);
  plan.pace = stopping.pace;
  plan.lead = plan.lead * retained + driven.way + stopping.way;
  plan.peak_speed = std::max(plan.peak_speed * retained, driven_s > 0 ? std::abs(plan.speed) : 0);
  plan.past_speed *= retained;
  plan.since = now;
}

GuardHistory GuardWatch::step(const WatchInput& input, TimePoint now) {
  check_wrench(input);
  check_taxels(input);
  seen_.too_fast.reset();
  seen_.not_following.reset();
  for (const Axis axis : all_axes) {
    const double position = input.position[axis];
    if (const auto at = input.stage_at[index(axis)]) check_speed(axis, position, *at);
    const double away = lag(axis, position, now);
    if (away <= lag_allowed(axis)) continue;
    seen_.not_following = axis;
    seen_.following_error = away;
  }
  return seen_;
}

void GuardWatch::check_wrench(const WatchInput& input) {
  if (!input.wrench_at || (wrench_ && wrench_->at == *input.wrench_at)) return;
  const Reading now{joined(input), *input.wrench_at};
  if (!wrench_ || wrench_->value != now.value) wrench_changed_ = now.at;
  seen_.wrench_frozen = now.at - wrench_changed_;
  const bool comparable = believed_ && !input.zero_moves && limits_.wrench_jump_n > 0 &&
                          now.at - wrench_->at <= limits_.wrench_gap;
  seen_.wrench_jump_n = comparable ? distance(now.value, believed_->value) : 0;
  const bool far =
      comparable && seen_.wrench_jump_n > limits_.wrench_jump_n && !is_landing(now, input);
  seen_.wrench_jumps = far ? seen_.wrench_jumps + 1 : 0;
  wrench_ = now;
  if (!far) believed_ = now;
}

// A stiff fabric takes the weight within a few micrometres, between two readings. The force may
// exceed the weight for a reading or two, which does not count as a jump.
bool GuardWatch::is_landing(const Reading& now, const WatchInput& input) const {
  const auto step = [&](std::size_t i) { return now.value[i] - believed_->value[i]; };
  const double load_n = step(2);
  return (load_n > 0 ? input.can_land : input.can_lift) && std::abs(load_n) <= limits_.landing_n &&
         std::hypot(step(0), step(1)) <= limits_.wrench_jump_n;
}

void GuardWatch::check_taxels(const WatchInput& input) {
  taxels_.resize(input.taxels.size());
  seen_.taxels_frozen = {};
  for (std::size_t i = 0; i < taxels_.size(); ++i) {
    const TaxelReading& now = input.taxels[i];
    TaxelsSeen& seen = taxels_[i];
    if (!now.at) continue;
    if (!seen.newest.at || seen.newest.digest != now.digest) seen.changed = *now.at;
    seen.newest = now;
    seen_.taxels_frozen = std::max(seen_.taxels_frozen, *now.at - seen.changed);
  }
}

// Leaky bucket: late reports fill it for a moment, a runaway stage fills it permanently.
void GuardWatch::check_speed(Axis axis, double position, TimePoint at) {
  const std::size_t i = index(axis);
  const double top = limits_.max_speed[i];
  std::optional<Reading>& last = stage_[i];
  if (last && last->at == at) return;
  if (last && top > 0) {
    const double covered = std::abs(position - last->value[0]);
    const double explained = speed_tolerance * top * to_seconds(at - last->at);
    excess_[i] = std::max(0.0, excess_[i] + covered - explained);
    if (excess_[i] > top * speed_reserve_s) seen_.too_fast = axis;
  }
  last = Reading{{position}, at};
}

double GuardWatch::lag(Axis axis, double position, TimePoint now) {
  Plan& plan = plans_[index(axis)];
  if (plan.driven) {
    integrate(axis, now);
    if (plan.seen_at) plan.lead -= position - *plan.seen_at;
    plan.seen_at = position;
    return plan.released ? 0 : std::abs(plan.lead);
  }
  if (!plan.moving) return 0;
  const double way =
      std::min(plan.speed * to_seconds(now - plan.since), std::abs(plan.target - plan.from));
  const double covered = (position - plan.from) * (plan.target < plan.from ? -1 : 1);
  return std::max(0.0, way - covered);
}

double GuardWatch::lag_allowed(Axis axis) const {
  const Plan& plan = plans_[index(axis)];
  const double acceleration = limits_.max_acceleration[index(axis)];
  if (plan.driven) {
    // The ramp is modelled already; the rest of the reserve remains.
    const double reserve_s =
        std::max(driven_latency_s, driven_reserve_s - 0.5 * plan.peak_speed / acceleration);
    return driven_slack_m +
           std::max(reserve_s * plan.peak_speed, braking_latency_s * plan.past_speed);
  }
  // The stage may brake from its former motion, reverse and accelerate: two ramps.
  const double ramps_s = 2 * plan.speed / acceleration;
  return (is_linear(axis) ? following_slack_m : following_slack_rad) +
         plan.speed * (following_reserve_s + ramps_s);
}

}  // namespace weft::recipes
