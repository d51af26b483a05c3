// Conversation, status and parameters. Motion is in apt_stage_motion.cpp.

#include "sim/devices/apt_stage_emulator.hpp"

#include <algorithm>

#include "sim/devices/apt_units.hpp"

namespace weft::sim {

namespace {

using namespace protocols::apt;

constexpr Duration update_period = std::chrono::milliseconds(100);  // APT16: 10 Hz
constexpr std::uint16_t kcube_hardware_type = 16;                   // seen for K-cubes (A.5, M)

/// SET messages whose bodies are kept as they came and given back on request. The REQ id is one
/// above the SET id, the GET id two.
constexpr std::array kept_parameters{
    MessageId::set_velparams,     MessageId::set_jogparams,     MessageId::set_limswitchparams,
    MessageId::set_powerparams,   MessageId::set_genmoveparams, MessageId::set_homeparams,
    MessageId::set_moverelparams, MessageId::set_moveabsparams, MessageId::set_dcpidparams,
    MessageId::set_avmodes,       MessageId::set_bowindex,
};

constexpr MessageId plus(MessageId id, int n) {
  return static_cast<MessageId>(static_cast<int>(id) + n);
}

template <class Body>
Bytes body_bytes(const Body& body) {
  Bytes bytes;
  append_body(bytes, body);
  return bytes;
}

std::int32_t or_zero(const Result<std::int32_t>& counts) {
  return counts ? *counts : 0;
}

}  // namespace

AptStageEmulator::AptStageEmulator(const AptStageParams& params, BenchWorld& world, TimePoint now)
    : params_(params), world_(&world) {
  WEFT_ASSERT(params_.stage != nullptr);
  world_->stage(params_.axis, now).stop(0, now);
  zero_ = stage().position(now);
  set_default_parameters();
}

bool AptStageEmulator::servo() const {
  return params_.stage->family == Family::servo;
}

const Stage& AptStageEmulator::stage() const {
  return static_cast<const BenchWorld*>(world_)->stage(params_.axis);
}

void AptStageEmulator::set_default_parameters() {
  const StageModel& model = *params_.stage;
  VelocityParams velocity;
  velocity.acceleration_counts =
      or_zero(acceleration_to_counts(model.scale, model.default_acceleration));
  velocity.maximum_velocity_counts = or_zero(velocity_to_counts(model.scale, model.default_speed));
  parameters_[MessageId::set_velparams] = body_bytes(velocity);
  JogParams jog;
  jog.step_counts = or_zero(position_to_counts(model.scale, 5));  // 5 mm or 5 degrees (A.7)
  jog.acceleration_counts = velocity.acceleration_counts;
  jog.maximum_velocity_counts = velocity.maximum_velocity_counts;
  parameters_[MessageId::set_jogparams] = body_bytes(jog);
  LimitSwitchParams limits;
  limits.forward_hardware = model.forward_limit;
  limits.reverse_hardware = model.reverse_limit;
  parameters_[MessageId::set_limswitchparams] = body_bytes(limits);
  HomeParams homing;
  homing.direction = model.home_direction;
  homing.limit_switch = model.home_limit_switch;
  homing.velocity_counts = or_zero(velocity_to_counts(model.scale, model.home_speed));
  homing.offset_counts = or_zero(position_to_counts(model.scale, model.home_offset));
  parameters_[MessageId::set_homeparams] = body_bytes(homing);
  for (const MessageId id :
       {MessageId::set_genmoveparams, MessageId::set_moverelparams, MessageId::set_moveabsparams})
    parameters_[id] = body_bytes(ChannelCounts{});
  parameters_[MessageId::set_powerparams] = body_bytes(PowerParams{});
  parameters_[MessageId::set_bowindex] = body_bytes(BowIndex{});
}

void AptStageEmulator::receive(ByteView bytes, TimePoint now, ByteSink& out) {
  wake(now, out);
  splitter_.push(bytes);
  while (splitter_.next(message_)) handle(message_, now, out);
}

std::optional<TimePoint> AptStageEmulator::next_wakeup() const {
  if (motion_ == Motion::none) return next_update_;
  const TimePoint end = stage().end();
  return next_update_ ? std::min(*next_update_, end) : end;
}

void AptStageEmulator::wake(TimePoint now, ByteSink& out) {
  for (auto at = next_wakeup(); at && *at <= now; at = next_wakeup()) {
    if (motion_ != Motion::none && stage().end() <= *at) {
      finish_motion(*at, out);
    } else {
      send_update(*at, out);
      next_update_ = *at + update_period;
    }
  }
}

void AptStageEmulator::send_update(TimePoint now, ByteSink& out) {
  if (servo() && params_.silent_after != 0 && unacknowledged_ >= params_.silent_after) return;
  ++unacknowledged_;
  reply_status(servo() ? MessageId::get_dcstatusupdate : MessageId::get_statusupdate, now, out);
}

void AptStageEmulator::handle(const Message& message, TimePoint now, ByteSink& out) {
  if (message.dest != params_.address) {
    ++ignored_;
    return;
  }
  host_ = message.source;
  const bool known = handle_system(message, now, out) || handle_motion(message, now, out) ||
                     handle_status(message, now, out) || handle_parameters(message, now, out);
  if (!known) ++ignored_;
}

bool AptStageEmulator::handle_system(const Message& message, TimePoint now, ByteSink& out) {
  switch (message.id) {
    case MessageId::hw_req_info:
      reply_info(out);
      return true;
    case MessageId::hw_start_updatemsgs:
      next_update_ = now + update_period;
      unacknowledged_ = 0;
      return true;
    case MessageId::hw_stop_updatemsgs:
    case MessageId::hw_disconnect:
      next_update_.reset();
      return true;
    case MessageId::mod_set_chanenablestate:
      enabled_ = message.param2 == 1;
      return true;
    case MessageId::mod_req_chanenablestate:
      reply_short(MessageId::mod_get_chanenablestate, 1, enabled_ ? 1 : 2, out);
      return true;
    case MessageId::hw_no_flash_programming:
    case MessageId::mod_identify:
    case MessageId::set_eepromparams:
      return true;
    default:
      return false;
  }
}

bool AptStageEmulator::handle_status(const Message& message, TimePoint now, ByteSink& out) {
  switch (message.id) {
    case MessageId::req_statusbits:
      reply(MessageId::get_statusbits, StatusBits{1, status_bits(now)}, out);
      return true;
    case MessageId::req_statusupdate:
      if (servo()) return false;
      reply_status(MessageId::get_statusupdate, now, out);
      return true;
    case MessageId::req_dcstatusupdate:
      if (!servo()) return false;
      reply_status(MessageId::get_dcstatusupdate, now, out);
      return true;
    case MessageId::ack_dcstatusupdate:
      unacknowledged_ = 0;
      return servo();
    default:
      return false;
  }
}

bool AptStageEmulator::handle_parameters(const Message& message, TimePoint now, ByteSink& out) {
  if (message.id == MessageId::req_poscounter || message.id == MessageId::req_enccounter) {
    reply(plus(message.id, 1), ChannelCounts{1, counter(now)}, out);
    return true;
  }
  if (message.id == MessageId::set_poscounter) {
    if (const auto body = decode_body<ChannelCounts>(message.data))
      zero_ += counter_si(counter(now)) - counter_si(body->value_counts);
    return true;
  }
  for (const MessageId set : kept_parameters) {
    if (message.id == set) {
      set_parameters(message, now);
      return true;
    }
    const auto kept = parameters_.find(set);
    if (message.id != plus(set, 1) || kept == parameters_.end()) continue;
    buffer_.clear();
    append_long_header(buffer_, plus(set, 2), kept->second.size(), {host_, params_.address});
    buffer_.insert(buffer_.end(), kept->second.begin(), kept->second.end());
    out(buffer_);
    return true;
  }
  return false;
}

void AptStageEmulator::set_parameters(const Message& message, TimePoint) {
  if (documented_data_size(message.id) == message.data.size())
    parameters_[message.id] = message.data;
  else
    ++ignored_;
}

std::uint32_t AptStageEmulator::status_bits(TimePoint now) const {
  std::uint32_t bits = status::motor_connected;
  if (enabled_) bits |= status::channel_enabled;
  if (homed_) bits |= status::homed;
  if (motion_ == Motion::home) bits |= status::homing;
  if (motion_ == Motion::move || motion_ == Motion::stopping)
    bits |= stage().velocity(now) >= 0 ? status::moving_forward : status::moving_reverse;
  const double at = stage().position(now);
  const bool linear = params_.stage->axis == protocols::apt::Axis::linear;
  if (linear && at >= stage().params().high) bits |= status::forward_limit;
  return bits;
}

void AptStageEmulator::reply_short(MessageId id, std::uint8_t param1, std::uint8_t param2,
                                   ByteSink& out) {
  buffer_.clear();
  append_short(buffer_, id, param1, param2, {host_, params_.address});
  out(buffer_);
}

template <class Body>
void AptStageEmulator::reply(MessageId id, const Body& body, ByteSink& out) {
  buffer_.clear();
  append_message(buffer_, id, body, {host_, params_.address});
  out(buffer_);
}

/// The 14 bytes that status updates and the ends of moves share. The servo's velocity field is left
/// zero: documents disagree on its scale.
void AptStageEmulator::reply_status(MessageId id, TimePoint now, ByteSink& out) {
  if (servo())
    reply(id, DcStatusUpdate{1, counter(now), 0, 0, status_bits(now)}, out);
  else
    reply(id, StatusUpdate{1, counter(now), 0, status_bits(now)}, out);
}

void AptStageEmulator::reply_info(ByteSink& out) {
  HardwareInfo info;
  info.serial = params_.serial;
  info.model = Text<8>::from(params_.model);
  info.hardware_type = kcube_hardware_type;
  info.firmware_minor = 3;
  info.firmware_interim = 2;
  info.firmware_major = 1;
  info.notes = Text<48>::from("Weft emulator");
  info.stage_id = params_.stage->stage_id;
  info.hardware_version = 1;
  reply(MessageId::hw_get_info, info, out);
}

double AptStageEmulator::counter_si(std::int32_t counts) const {
  return si_per_unit(*params_.stage) * position_from_counts(params_.stage->scale, counts);
}

std::int32_t AptStageEmulator::counter(TimePoint now) const {
  const double units = (stage().position(now) - zero_) / si_per_unit(*params_.stage);
  return or_zero(position_to_counts(params_.stage->scale, units));
}

}  // namespace weft::sim
