// Counters and the status word of the APT stage.

#include "sim/devices/apt_parameters.hpp"
#include "sim/devices/apt_stage_emulator.hpp"

namespace weft::sim {

using namespace protocols::apt;

std::uint32_t AptStageEmulator::status_bits(TimePoint now) const {
  std::uint32_t bits = status::motor_connected | motion_bits(now) | limit_bits(now);
  if (enabled_) bits |= status::channel_enabled;
  if (homed_) bits |= status::homed;
  if (active_fault(FaultKind::motion_error, now) != nullptr) bits |= status::motion_error;
  if (active_fault(FaultKind::over_temperature, now) != nullptr) bits |= status::over_temperature;
  return bits;
}

/// The bits of one motion add up: "in motion, moving clockwise" is of the shaft, "performing a
/// homing move" and "jogging" of why (issue of December 2025, GET_USTATUSUPDATE; Thorlabs' adapter
/// for Micro-Manager: "1 - moving, 0 - stationary"). No source shows the word of a real unit that
/// homes.
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
  const auto soft =
      decode_body<LimitSwitchParams>(parameters_.body(MessageId::set_limswitchparams));
  if (!soft || (soft->soft_mode & 0x7F) <= 1) return bits;
  const std::int32_t count = counts_at(at);
  if (count >= soft->forward_soft_counts) bits |= status::forward_soft_limit;
  if (count <= soft->reverse_soft_counts) bits |= status::reverse_soft_limit;
  return bits;
}

double AptStageEmulator::length(std::int32_t counts) const {
  return si_per_unit(*params_.stage) * position_from_counts(params_.stage->scale, counts);
}

std::int32_t AptStageEmulator::counts_at(double position) const {
  const double units = (position - zero_) / si_per_unit(*params_.stage);
  return position_to_counts(params_.stage->scale, units).value_or(0);
}

/// Where the controller takes the stage to be: it counts lost steps as done.
double AptStageEmulator::believed(TimePoint now) const {
  const double at = stage().position(now);
  if (lost_ == 0 && steps_per_way_ == 1) return at;
  return at + lost_ + (at - lossy_from_) * (steps_per_way_ - 1);
}

std::int32_t AptStageEmulator::counter(TimePoint now) const {
  return frozen_counter_ ? *frozen_counter_ : counts_at(believed(now));
}

std::int32_t AptStageEmulator::encoder(TimePoint now) const {
  if (frozen_counter_) return *frozen_counter_ - encoder_zero_counts_;
  return counts_at(stage().position(now)) - encoder_zero_counts_;
}

/// The LTS lists neither the switch of end-of-move messages nor the acknowledgement
/// (device-facts.md, APT controllers).
bool AptStageEmulator::lists_end_message_switch() const {
  return servo() || !params_.model.starts_with("LTS");
}

}  // namespace weft::sim
