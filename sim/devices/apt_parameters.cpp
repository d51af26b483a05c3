#include "sim/devices/apt_stage_emulator.hpp"

#include <algorithm>

namespace weft::sim {

namespace {

using namespace protocols::apt;

template <class Body>
Bytes bytes_of(const Body& body) {
  Bytes bytes;
  append_body(bytes, body);
  return bytes;
}

/// A body with only the channel, 1, set.
Bytes blank(std::size_t size) {
  Bytes bytes(size, 0);
  bytes[0] = 1;
  return bytes;
}

std::int32_t or_zero(const Result<std::int32_t>& counts) {
  return counts ? *counts : 0;
}

VelocityParams velocity_of(const StageModel& model) {
  VelocityParams velocity;
  velocity.acceleration_counts =
      or_zero(acceleration_to_counts(model.scale, model.default_acceleration));
  velocity.maximum_velocity_counts = or_zero(velocity_to_counts(model.scale, model.default_speed));
  return velocity;
}

// 5 mm at 10 mm/s and 10 mm/s2, 5 degrees at 15 (device-facts.md, APT stage data), limited to what
// the stage can do.
JogParams jog_of(const StageModel& model) {
  const double speed = model.family == Family::servo ? 15 : 10;
  JogParams jog;
  jog.step_counts = or_zero(position_to_counts(model.scale, 5));
  jog.maximum_velocity_counts =
      or_zero(velocity_to_counts(model.scale, std::min(speed, model.max_speed)));
  jog.acceleration_counts =
      or_zero(acceleration_to_counts(model.scale, std::min(speed, model.max_acceleration)));
  return jog;
}

HomeParams homing_of(const StageModel& model) {
  HomeParams homing;
  homing.direction = model.home_direction;
  homing.limit_switch = model.home_limit_switch;
  homing.velocity_counts = or_zero(velocity_to_counts(model.scale, model.home_speed));
  homing.offset_counts = or_zero(position_to_counts(model.scale, model.home_offset));
  return homing;
}

/// Deflections from 20, 50, 80 and 100, as in the document's example. They give a tenth, a fifth,
/// three tenths and half of the default speed, in position counts per second [E].
PotParams slider_of(const StageModel& model) {
  const auto part = [&](double of_speed) {
    return or_zero(position_to_counts(model.scale, of_speed * model.default_speed));
  };
  return {1, 20, part(0.1), 50, part(0.2), 80, part(0.3), 100, part(0.5)};
}

/// Velocity mode at the default speed; half bright, dimmed after ten minutes [E].
KcubePanelParams panel_of(const StageModel& model) {
  const VelocityParams velocity = velocity_of(model);
  KcubePanelParams panel;
  panel.maximum_velocity_counts = velocity.maximum_velocity_counts;
  panel.acceleration_counts = velocity.acceleration_counts;
  panel.brightness_percent = 50;
  panel.dim_after_min = 10;
  panel.dim_level = 2;
  return panel;
}

/// PRM1-Z8: 850, 150, 2720, 50 (device-facts.md, APT stage data); all four filters on.
Bytes pid_of_prm1_z8() {
  Bytes bytes;
  LittleWriter writer(bytes);
  writer.write(std::uint16_t{1});
  for (const std::uint32_t value : {850U, 150U, 2720U, 50U}) writer.write(value);
  writer.write(std::uint16_t{0x000F});
  return bytes;
}

}  // namespace

AptParameters::AptParameters(const StageModel& model) {
  LimitSwitchParams limits;
  limits.forward_hardware = model.forward_limit;
  limits.reverse_hardware = model.reverse_limit;
  if (model.axis == Axis::rotary) limits.soft_mode |= 0x80;
  const ChannelCounts backlash{1, or_zero(position_to_counts(model.scale, model.backlash))};
  stored_ = {{MessageId::set_velparams, bytes_of(velocity_of(model))},
             {MessageId::set_jogparams, bytes_of(jog_of(model))},
             {MessageId::set_limswitchparams, bytes_of(limits)},
             {MessageId::set_homeparams, bytes_of(homing_of(model))},
             {MessageId::set_genmoveparams, bytes_of(backlash)},
             {MessageId::set_moverelparams, bytes_of(ChannelCounts{})},
             {MessageId::set_moveabsparams, bytes_of(ChannelCounts{})},
             {MessageId::set_powerparams, bytes_of(PowerParams{1, 15, 30})},
             {MessageId::set_bowindex, bytes_of(BowIndex{})},
             {MessageId::set_pmdprofilemode, bytes_of(ProfileMode{})},
             {MessageId::set_avmodes, blank(4)},
             {MessageId::set_potparams, bytes_of(slider_of(model))},
             {MessageId::set_buttonparams, bytes_of(ButtonParams{1, 1, 0, 0, 2000, 2000})},
             {MessageId::set_dcpidparams, pid_of_prm1_z8()},
             {MessageId::set_kcubemmiparams, bytes_of(panel_of(model))},
             {MessageId::set_kcubetrigconfig, blank(12)},
             {MessageId::set_kcubepostrig, blank(34)},
             {MessageId::set_loopparams, blank(36)}};
  limits_ = body<LimitSwitchParams>(MessageId::set_limswitchparams);
}

AptParameters::Answer AptParameters::handle(const Message& message) {
  for (auto& [set, body] : stored_) {
    if (message.id == plus(set, 1)) return {Outcome::is_request, plus(set, 2), &body};
    if (message.id != set) continue;
    const auto documented = documented_data_size(set);
    const bool fits = documented ? message.data.size() == *documented : !message.data.empty();
    if (!fits) return {Outcome::refused, set, nullptr};
    // Issues and hosts disagree on the length of a K-cube's messages; the answer keeps its own
    // length.
    std::copy_n(message.data.begin(), std::min(body.size(), message.data.size()), body.begin());
    limits_ = this->body<LimitSwitchParams>(MessageId::set_limswitchparams);
    return {Outcome::taken, set, nullptr};
  }
  return {};
}

}  // namespace weft::sim
