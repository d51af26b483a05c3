// Motion commands of the APT stage, messages at their ends, the counters and the status word.

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/devices/apt_stage_emulator.hpp"

namespace weft::sim {
namespace {

using namespace protocols::apt;

constexpr double slowest = 1e-9;  // units/s; with a zero in VELPARAMS a move would never end
constexpr int highest_bow = 18;
/// Closer to home than this, in mm or degrees, the home switch is active already. The stage then
/// runs off it first, so that homing always moves.
constexpr double on_home_switch = 0.1;
constexpr std::uint8_t forward = 1, reverse = 2;

/// Jerk limit in units/s^3: 2^(index - 1) from 1 to 18, none at 0 (LTS manual 16275-D02, p. 37).
double bow_value(const BowIndex& bow) {
  return bow.index == 0 ? 0 : std::ldexp(1.0, std::min<int>(bow.index, highest_bow) - 1);
}

/// Speed of the counts in SI units, limited to that of the stage.
double speed_of(const StageModel& model, std::int32_t velocity_counts) {
  const double speed = velocity_from_counts(model.scale, velocity_counts);
  return si_per_unit(model) * std::clamp(speed, slowest, model.max_speed);
}
/// An S-curve without a given jerk reaches its acceleration in this time.
constexpr double usual_ramp_s = 0.1;

double acceleration_of(const StageModel& model, std::int32_t acceleration_counts) {
  const double acceleration = acceleration_from_counts(model.scale, acceleration_counts);
  return si_per_unit(model) * std::clamp(acceleration, slowest, model.max_acceleration);
}

}  // namespace

MotionLimits AptStageEmulator::limits() const {
  const StageModel& model = *params_.stage;
  const auto body = parameters_.body<VelocityParams>(MessageId::set_velparams);
  const double acceleration = acceleration_of(model, body.acceleration_counts);
  double jerk = si_per_unit(model) * bow_value(parameters_.body<BowIndex>(MessageId::set_bowindex));
  if (model.is_brushless()) {  // the scale of its jerk is unknown
    const auto profile = parameters_.body<ProfileMode>(MessageId::set_pmdprofilemode);
    jerk = profile.mode == 2 ? acceleration / usual_ramp_s : 0;
  }
  return {speed_of(model, body.maximum_velocity_counts), acceleration, jerk};
}

MotionLimits AptStageEmulator::jog_limits() const {
  const auto body = parameters_.body<JogParams>(MessageId::set_jogparams);
  return {speed_of(*params_.stage, body.maximum_velocity_counts),
          acceleration_of(*params_.stage, body.acceleration_counts), limits().jerk};
}

MotionLimits AptStageEmulator::home_limits() const {
  MotionLimits result = limits();
  const auto body = parameters_.body<HomeParams>(MessageId::set_homeparams);
  result.speed = speed_of(*params_.stage, body.velocity_counts);
  return result;
}

/// The home switch is below the zero by the stage's own offset, and the configured offset leads
/// back from there. Homing forwards goes to the other end.
double AptStageEmulator::home_position() const {
  const StageModel& model = *params_.stage;
  const auto offset = parameters_.body<HomeParams>(MessageId::set_homeparams).offset_counts;
  if (homes_at_high_end()) return stage().params().high - length(offset);
  const std::int32_t usual = position_to_counts(model.scale, model.home_offset).value_or(0);
  return offset != usual ? length(offset) - length(usual) : 0;
}

/// A rotary stage has one switch, reached from either side.
bool AptStageEmulator::homes_at_high_end() const {
  return params_.stage->axis == Axis::linear &&
         parameters_.body<HomeParams>(MessageId::set_homeparams).direction == forward;
}

double AptStageEmulator::inside_soft_limits(double target) const {
  const LimitSwitchParams& soft = parameters_.limits();
  if ((soft.soft_mode & 0x7F) <= 1) return target;
  return std::max(std::min(target, zero_ + length(soft.forward_soft_counts)),
                  zero_ + length(soft.reverse_soft_counts));
}

bool AptStageEmulator::handle_motion(const Message& message, TimePoint now, ByteSink& out) {
  switch (message.id) {
    case MessageId::move_home:
      home(now, out);
      return true;
    case MessageId::move_absolute:
      return move(message, false, now);
    case MessageId::move_relative:
      return move(message, true, now);
    case MessageId::move_jog:
      jog(message, now);
      return true;
    case MessageId::move_velocity:
      run_towards_limit(message.param2, limits(), Motion::move, now);
      return true;
    case MessageId::move_stop:
      stop(message, now);
      wake(now, out);  // a stop that ends at once is reported at once
      return true;
    case MessageId::suspend_endofmovemsgs:
    case MessageId::resume_endofmovemsgs:
      if (lists_end_message_switch()) end_messages_ = message.id == MessageId::resume_endofmovemsgs;
      return lists_end_message_switch();
    default:
      return false;
  }
}

void AptStageEmulator::home(TimePoint now, ByteSink& out) {
  if (!enabled_) return;
  if (active_fault(FaultKind::false_home, now) != nullptr) {
    homed_ = true;
    return reply_short(MessageId::move_homed, 1, 0, out);
  }
  homed_ = false;
  const double unit = si_per_unit(*params_.stage), switch_at = home_position();
  const double run_off = params_.stage->home_offset * unit * (homes_at_high_end() ? -1 : 1);
  if (std::abs(stage().position(now) - switch_at) < on_home_switch * unit)
    return home_to(switch_at + run_off, Motion::home_run_off, now);
  home_to(switch_at, Motion::home, now);
}

/// Homing ends at the true motor position, so lost steps make no difference.
void AptStageEmulator::home_to(double target, Motion leg, TimePoint now) {
  zero_ -= believed(now) - stage().position(now);
  lost_ = 0;
  steps_per_way_ = 1;
  goal_ = target;
  goal_limits_ = home_limits();
  runs_to_low_end_ = on_low_end_ = false;
  bench_plant_->stage(params_.axis, now).move_to(goal_, goal_limits_, now);
  motion_ = leg;
}

bool AptStageEmulator::move(const Message& message, bool relative, TimePoint now) {
  const auto stored = relative ? MessageId::set_moverelparams : MessageId::set_moveabsparams;
  const auto body = message.data.empty()
                        ? Result<ChannelCounts>(parameters_.body<ChannelCounts>(stored))
                        : decode_body<ChannelCounts>(message.data);
  if (!body) return false;
  const double from = relative ? believed(now) : zero_;
  move_to(from + length(body->value_counts), limits(), Motion::move, now);
  return true;
}

void AptStageEmulator::jog(const Message& message, TimePoint now) {
  const auto body = parameters_.body<JogParams>(MessageId::set_jogparams);
  if (body.mode == JogMode::continuous)
    return run_towards_limit(message.param2, jog_limits(), Motion::jog, now);
  const double sign = increases_counts(message.param2) ? 1 : -1;
  move_to(believed(now) + sign * length(body.step_counts), jog_limits(), Motion::jog, now);
}

/// "Forward" is the controller's term; its direction differs (device-facts.md, APT messages).
bool AptStageEmulator::increases_counts(std::uint8_t direction) const {
  return (direction == reverse) == (params_.positive_direction == reverse);
}

/// APT16 names this the velocity move: it ends by a stop or at a limit.
void AptStageEmulator::run_towards_limit(std::uint8_t direction, const MotionLimits& limits,
                                         Motion kind, TimePoint now) {
  const StageParams& travel = stage().params();
  move_to(increases_counts(direction) ? travel.high : travel.low, limits, kind, now);
  runs_to_low_end_ = motion_ != Motion::none && goal_ <= travel.low;
}

void AptStageEmulator::move_to(double target, const MotionLimits& limits, Motion kind,
                               TimePoint now) {
  const bool homing = motion_ == Motion::home || motion_ == Motion::home_run_off;
  if (!enabled_ || homing) return;
  if (motion_ != Motion::none && params_.retarget == RetargetPolicy::ignore) return;
  plan(inside_soft_limits(target), limits, now);
  motion_ = kind;
  runs_to_low_end_ = goal_ < stage().params().low;
}

void AptStageEmulator::plan(double target, const MotionLimits& limits, TimePoint now) {
  const double at = stage().position(now), counted = believed(now);
  lost_ = counted - at;
  lossy_from_ = at;
  steps_per_way_ = 1;
  if (const Fault* far = active_fault(FaultKind::overshoot, now))
    target += std::copysign(far->amount * si_per_unit(*params_.stage), target - counted);
  if (const Fault* lossy = active_fault(FaultKind::lost_steps, now))
    steps_per_way_ = 1 / (1 - std::clamp(lossy->amount, 0.0, 0.99));
  goal_ = steps_per_way_ == 1 ? target - lost_ : at + (target - counted) / steps_per_way_;
  goal_limits_ = limits;
  bench_plant_->stage(params_.axis, now).move_to(goal_, limits, now);
  runs_to_low_end_ = on_low_end_ = false;
}

void AptStageEmulator::stop(const Message& message, TimePoint now) {
  const bool immediate = message.param2 == static_cast<std::uint8_t>(StopMode::immediate);
  bench_plant_->stage(params_.axis, now).stop(immediate ? 0 : limits().acceleration, now);
  held_ = hung_ = false;
  motion_ = Motion::stopping;
}

void AptStageEmulator::finish_motion(TimePoint at, ByteSink& out) {
  const Motion ended = motion_;
  if (ended == Motion::home_run_off) return home_to(home_position(), Motion::home, at);
  if (ended == Motion::home && active_fault(FaultKind::never_homes, at) != nullptr) {
    hung_ = true;
    return;
  }
  motion_ = Motion::none;
  if (ended == Motion::home) {
    homed_ = true;
    zero_ = stage().position(at);
    if (end_messages_ && active_fault(FaultKind::no_completion, at) == nullptr)
      reply_short(MessageId::move_homed, 1, 0, out);
    return;
  }
  on_low_end_ = runs_to_low_end_ && stage().position(at) <= stage().params().low;
  send_end_of_motion(
      ended == Motion::stopping ? MessageId::move_stopped : MessageId::move_completed, at, out);
}

void AptStageEmulator::send_end_of_motion(MessageId id, TimePoint at, ByteSink& out) {
  if (!end_messages_ || active_fault(FaultKind::no_completion, at) != nullptr) return;
  if (const Fault* late = active_fault(FaultKind::late_completion, at))
    late_end_ = LateEnd{at + from_seconds(late->amount), id};
  else
    send_end(id, at, out);
}

/// Applies faults that begin, end or continue while the stage moves.
void AptStageEmulator::apply_motion_faults(TimePoint now, ByteSink& out) {
  if (!has_faults() && !hung_ && !held_ && !frozen_counter_) return;
  if (hung_ && active_fault(FaultKind::never_homes, now) == nullptr) hung_ = false;
  apply_stall_faults(now);
  frozen(FaultKind::encoder_frozen, now, counter(now), frozen_counter_);
  const bool dead = active_fault(FaultKind::disabled, now) != nullptr;
  if (dead) enabled_ = false;
  const bool stopped = dead || active_fault(FaultKind::limit_switch, now) != nullptr;
  if (!stopped || motion_ == Motion::none) return;
  bench_plant_->stage(params_.axis, now).stop(0, now);
  held_ = hung_ = false;
  motion_ = Motion::none;
  if (!dead) send_end_of_motion(MessageId::move_stopped, now, out);
}

void AptStageEmulator::apply_stall_faults(TimePoint now) {
  const bool stalled = active_fault(FaultKind::motor_stall, now) != nullptr;
  if (stalled && motion_ != Motion::none && motion_ != Motion::stopping) {
    bench_plant_->stage(params_.axis, now).stop(0, now);
    held_ = true;
  } else if (held_ && !stalled) {
    held_ = false;
    bench_plant_->stage(params_.axis, now).move_to(goal_, goal_limits_, now);
  }
}

using namespace protocols::apt;

std::uint32_t AptStageEmulator::status_bits(TimePoint now) const {
  std::uint32_t bits = status::motor_connected | motion_bits(now) | limit_bits(now);
  if (enabled_) bits |= status::channel_enabled;
  if (homed_) bits |= status::homed;
  if (active_fault(FaultKind::motion_error, now) != nullptr) bits |= status::motion_error;
  if (active_fault(FaultKind::over_temperature, now) != nullptr) bits |= status::over_temperature;
  return bits;
}

/// The bits of one motion combine: "in motion, moving clockwise" describes the shaft, "performing a
/// homing move" and "jogging" the reason (issue of December 2025, GET_USTATUSUPDATE; Thorlabs'
/// adapter for Micro-Manager: "1 - moving, 0 - stationary"). No source shows the word of a real
/// unit during homing.
std::uint32_t AptStageEmulator::motion_bits(TimePoint now) const {
  const double velocity = stage().velocity(now);
  const bool forward = velocity == 0 ? goal_ >= stage().position(now) : velocity > 0;
  const std::uint32_t moving = forward ? status::moving_forward : status::moving_reverse;
  switch (motion_) {
    case Motion::none:
      return 0;
    case Motion::home:
    case Motion::home_run_off:
      return moving | status::homing;
    case Motion::jog:
      return moving | (forward ? status::jogging_forward : status::jogging_reverse);
    case Motion::move:
    case Motion::stopping:
      return moving;
  }
  return 0;
}

std::uint32_t AptStageEmulator::limit_bits(TimePoint now) const {
  const double at = stage().position(now);
  const bool linear = params_.stage->axis == Axis::linear;
  const bool made = active_fault(FaultKind::limit_switch, now) != nullptr;
  std::uint32_t bits = 0;
  if (made || (linear && at >= stage().params().high)) bits |= status::forward_limit;
  if (linear && on_low_end_) bits |= status::reverse_limit;
  const LimitSwitchParams& soft = parameters_.limits();
  if ((soft.soft_mode & 0x7F) <= 1) return bits;
  const std::int32_t count = counts_at(at);
  if (count >= soft.forward_soft_counts) bits |= status::forward_soft_limit;
  if (count <= soft.reverse_soft_counts) bits |= status::reverse_soft_limit;
  return bits;
}

double AptStageEmulator::length(std::int32_t counts) const {
  return si_per_unit(*params_.stage) * position_from_counts(params_.stage->scale, counts);
}

std::int32_t AptStageEmulator::counts_at(double position) const {
  const double units = (position - zero_) / si_per_unit(*params_.stage);
  return position_to_counts(params_.stage->scale, units).value_or(0);
}

/// Stage position in the controller's view: lost steps count as moved.
double AptStageEmulator::believed(TimePoint now) const {
  const double at = stage().position(now);
  if (lost_ == 0 && steps_per_way_ == 1) return at;
  return at + lost_ + (at - lossy_from_) * (steps_per_way_ - 1);
}

std::int32_t AptStageEmulator::counter(TimePoint now) const {
  return frozen_counter_ ? *frozen_counter_ : counts_at(believed(now));
}

std::int32_t AptStageEmulator::encoder(TimePoint now) const {
  if (!params_.encoder) return -encoder_zero_counts_;  // without an encoder
  if (frozen_counter_) return *frozen_counter_ - encoder_zero_counts_;
  return counts_at(stage().position(now)) - encoder_zero_counts_;
}

/// The LTS lists neither the switch of end-of-move messages nor the acknowledgement
/// (device-facts.md, APT controllers).
bool AptStageEmulator::lists_end_message_switch() const {
  return servo() || !params_.model.starts_with("LTS");
}

/// Whether the controller's list has a message about counters or parameters (device-facts.md, APT
/// controllers; buttons: issue of December 2025). Unlisted messages are neither accepted nor
/// answered.
bool AptStageEmulator::lists(MessageId id) const {
  static constexpr std::array not_of_the_lts{
      MessageId::set_enccounter,      MessageId::set_powerparams,  MessageId::set_dcpidparams,
      MessageId::set_avmodes,         MessageId::set_potparams,    MessageId::set_kcubemmiparams,
      MessageId::set_kcubetrigconfig, MessageId::set_kcubepostrig, MessageId::set_loopparams,
      MessageId::set_trigger};
  if (!params_.model.starts_with("LTS")) return true;
  const auto is_of = [&](MessageId set) { return id == set || id == plus(set, 1); };
  return std::none_of(not_of_the_lts.begin(), not_of_the_lts.end(), is_of);
}

}  // namespace weft::sim
