// Motion commands of the APT stage, and what is said at their ends.

#include <algorithm>
#include <cmath>

#include "sim/devices/apt_stage_emulator.hpp"
#include "sim/devices/apt_units.hpp"

namespace weft::sim {

namespace {

using namespace protocols::apt;

constexpr double slowest = 1e-9;  // units/s; a zero in VELPARAMS would never arrive
constexpr int highest_bow = 18;

/// Jerk limit in units/s^3: 2^(index - 1) from 1 to 18, none at 0 (LTS manual 16275-D02, p. 37).
double bow_value(const Bytes& kept) {
  const auto body = decode_body<BowIndex>(kept);
  if (!body || body->index == 0) return 0;
  return std::ldexp(1.0, std::min<int>(body->index, highest_bow) - 1);
}

}  // namespace

MotionLimits AptStageEmulator::limits() const {
  const StageModel& model = *params_.stage;
  const double si = si_per_unit(model);
  double speed = model.default_speed, acceleration = model.default_acceleration;
  if (const auto body = decode_body<VelocityParams>(parameters_.at(MessageId::set_velparams))) {
    speed = velocity_from_counts(model.scale, body->maximum_velocity_counts);
    acceleration = acceleration_from_counts(model.scale, body->acceleration_counts);
  }
  return {si * std::clamp(speed, slowest, model.max_speed),
          si * std::clamp(acceleration, slowest, model.max_acceleration),
          si * bow_value(parameters_.at(MessageId::set_bowindex))};
}

MotionLimits AptStageEmulator::home_limits() const {
  const StageModel& model = *params_.stage;
  MotionLimits result = limits();
  const auto body = decode_body<HomeParams>(parameters_.at(MessageId::set_homeparams));
  const double speed =
      body ? velocity_from_counts(model.scale, body->velocity_counts) : model.home_speed;
  result.speed = si_per_unit(model) * std::clamp(speed, slowest, model.max_speed);
  return result;
}

bool AptStageEmulator::handle_motion(const Message& message, TimePoint now, ByteSink& out) {
  switch (message.id) {
    case MessageId::move_home:
      home(now);
      return true;
    case MessageId::move_absolute:
      return move(message, false, now);
    case MessageId::move_relative:
      return move(message, true, now);
    case MessageId::move_jog:
      jog(message, now);
      return true;
    case MessageId::move_velocity:
      run_towards_limit(message.param2, now);
      return true;
    case MessageId::move_stop:
      stop(message, now);
      wake(now, out);  // a stop that ends at once is reported at once
      return true;
    case MessageId::suspend_endofmovemsgs:
      end_messages_ = false;
      return servo();
    case MessageId::resume_endofmovemsgs:
      end_messages_ = true;
      return servo();
    default:
      return false;
  }
}

void AptStageEmulator::home(TimePoint now) {
  if (!enabled_) return;
  homed_ = false;
  world_->stage(params_.axis, now).move_to(0, home_limits(), now);
  motion_ = Motion::home;
}

bool AptStageEmulator::move(const Message& message, bool relative, TimePoint now) {
  const auto stored = relative ? MessageId::set_moverelparams : MessageId::set_moveabsparams;
  const auto body =
      decode_body<ChannelCounts>(message.data.empty() ? parameters_.at(stored) : message.data);
  if (!body) return false;
  const double from = relative ? stage().position(now) : zero_;
  move_to(from + counter_si(body->value_counts), now);
  return true;
}

void AptStageEmulator::jog(const Message& message, TimePoint now) {
  const auto body = decode_body<JogParams>(parameters_.at(MessageId::set_jogparams));
  if (!body || body->mode == JogMode::continuous) return run_towards_limit(message.param2, now);
  const double direction = message.param2 == 2 ? -1 : 1;
  move_to(stage().position(now) + direction * counter_si(body->step_counts), now);
}

/// APT16 names this the velocity move: until stopped or at a limit.
void AptStageEmulator::run_towards_limit(std::uint8_t direction, TimePoint now) {
  move_to(direction == 2 ? stage().params().low : stage().params().high, now);
}

void AptStageEmulator::move_to(double target, TimePoint now) {
  if (!enabled_ || motion_ == Motion::home) return;
  if (motion_ != Motion::none && params_.retarget == RetargetPolicy::ignore) return;
  world_->stage(params_.axis, now).move_to(target, limits(), now);
  motion_ = Motion::move;
}

void AptStageEmulator::stop(const Message& message, TimePoint now) {
  const bool immediate = message.param2 == static_cast<std::uint8_t>(StopMode::immediate);
  world_->stage(params_.axis, now).stop(immediate ? 0 : limits().acceleration, now);
  motion_ = Motion::stopping;
}

void AptStageEmulator::finish_motion(TimePoint at, ByteSink& out) {
  const Motion ended = motion_;
  motion_ = Motion::none;
  if (ended == Motion::home) {
    homed_ = true;
    zero_ = stage().position(at);
  }
  if (!end_messages_) return;
  switch (ended) {
    case Motion::home:
      return reply_short(MessageId::move_homed, 1, 0, out);
    case Motion::move:
      return reply_status(MessageId::move_completed, at, out);
    case Motion::stopping:
      return reply_status(MessageId::move_stopped, at, out);
    case Motion::none:
      return;
  }
}

}  // namespace weft::sim
