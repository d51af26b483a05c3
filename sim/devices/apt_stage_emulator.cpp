// Message handling: addressing and answers. Motion, the counters and the status word are in
// apt_stage_motion.cpp.
#include "sim/devices/apt_stage_emulator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace weft::sim {
namespace {

using namespace protocols::apt;

constexpr Duration update_period = std::chrono::milliseconds(100);  // APT16: 10 Hz
/// Longest wait for the rest of a message, from its beginning: later its host has gone, or its
/// length was damaged.
constexpr Duration partial_message_timeout = std::chrono::milliseconds(500);
constexpr std::uint16_t kcube_hardware_type = 16;  // K-cubes; no source [E]
constexpr std::uint16_t card_hardware_type = 44;
constexpr std::uint16_t rack_hardware_type = 45;

const StageModel& model_of(const AptStageParams& params) {
  WEFT_ASSERT(params.stage != nullptr);
  return *params.stage;
}

}  // namespace

AptStageEmulator::AptStageEmulator(const AptStageParams& params, BenchPlant& bench_plant,
                                   TimePoint now)
    : params_(params),
      bench_plant_(&bench_plant),
      parameters_(model_of(params)),
      enabled_(params.enabled) {
  const Controller* const controller = find_controller(params_.model);
  if (params_.positive_direction == 0)
    params_.positive_direction = controller != nullptr ? controller->positive_direction : 1;
  if (params_.bay) unit_ = static_cast<std::uint8_t>(address::bay_first + *params_.bay);
  bench_plant_->stage(params_.axis, now).stop(0, now);
  zero_ = lossy_from_ = stage().position(now);
  homed_ = params.homed;
  if (homed_) zero_ = home_position();
}

bool AptStageEmulator::servo() const {
  return params_.stage->family == Family::servo;
}

const Stage& AptStageEmulator::stage() const {
  return static_cast<const BenchPlant*>(bench_plant_)->stage(params_.axis);
}

void AptStageEmulator::receive(ByteView bytes, TimePoint now, ByteSink& out) {
  wake(now, out);
  if (begun_ && now - *begun_ > partial_message_timeout) splitter_.clear();
  if (!splitter_.in_progress()) begun_ = now;
  splitter_.push(bytes);
  while (splitter_.next(message_)) {
    begun_ = now;
    handle(message_, now, out);
  }
  apply_motion_faults(now, out);
}

void AptStageEmulator::meet_new_host() {
  splitter_.clear();
  begun_.reset();
  forget_host();
}

/// Clears the requests that are valid only while their host is connected.
void AptStageEmulator::forget_host() {
  next_update_.reset();
  unacknowledged_ = 0;
  end_messages_ = true;
}

std::optional<TimePoint> AptStageEmulator::next_wakeup() const {
  std::optional<TimePoint> next = next_update_;
  const auto sooner = [&](TimePoint at) {
    if (!next || at < *next) next = at;
  };
  if (end_awaited()) sooner(stage().end());
  if (late_end_) sooner(late_end_->due);
  return next;
}

void AptStageEmulator::wake(TimePoint now, ByteSink& out) {
  self_ = unit_;
  apply_motion_faults(now, out);
  for (auto at = next_wakeup(); at && *at <= now; at = next_wakeup()) {
    if (end_awaited() && stage().end() <= *at) {
      finish_motion(*at, out);
    } else if (late_end_ && late_end_->due <= *at) {
      send_end(late_end_->id, *at, out);
      late_end_.reset();
    } else {
      send_update(*at, out);
      next_update_ = *at + update_period;
    }
  }
}

/// Counts an unsolicited message; false once the controller is silent. Controllers that list
/// acknowledgements fall silent without them. So does the BSC, which lists none and then needs a
/// host that begins anew (docs/reference/device-facts.md, APT conversation). Its cards are named
/// SCC.
bool AptStageEmulator::can_send_unsolicited() {
  const bool falls_silent =
      servo() || params_.model.starts_with("BSC") || params_.model.starts_with("SCC");
  if (!falls_silent || params_.silent_after == 0) return true;
  if (unacknowledged_ >= params_.silent_after) return false;
  ++unacknowledged_;
  return true;
}

void AptStageEmulator::send_update(TimePoint now, ByteSink& out) {
  if (active_fault(FaultKind::silent_status, now) != nullptr || !can_send_unsolicited()) return;
  reply_status(servo() ? MessageId::get_dcstatusupdate : MessageId::get_statusupdate, now, out);
}

/// Ends of moves are status messages too: a servo without acknowledgement does not send them.
void AptStageEmulator::send_end(MessageId id, TimePoint now, ByteSink& out) {
  if (servo() && !can_send_unsolicited()) return;
  reply_status(id, now, out);
}

/// A unit with one channel answers to all addresses that hosts use for it, because clients differ.
bool AptStageEmulator::is_for_us(std::uint8_t destination) const {
  if (destination == address::rack || destination == unit_) return true;
  return !params_.bay && (destination == address::usb_unit || destination == address::bay_first);
}

void AptStageEmulator::handle(const Message& message, TimePoint now, ByteSink& out) {
  const auto documented = documented_data_size(message.id);
  if (!is_for_us(message.dest) || (documented && message.data.size() != *documented)) {
    ++ignored_;
    return;
  }
  host_ = message.source == 0 ? address::host : message.source;
  self_ = message.dest;
  if (message.dest != address::rack) unit_ = message.dest;
  const bool known =
      lists(message.id) && (handle_system(message, now, out) || handle_rack(message, out) ||
                            handle_motion(message, now, out) || handle_status(message, now, out) ||
                            handle_counters(message, now, out) || handle_parameters(message, out));
  if (!known) ++ignored_;
  self_ = unit_;
}

bool AptStageEmulator::handle_system(const Message& message, TimePoint now, ByteSink& out) {
  switch (message.id) {
    // The first messages of a host reset the count as an acknowledgement does. On a terminal hosts
    // change unseen, and the count of a former host must not affect the next one.
    case MessageId::hw_no_flash_programming:
      unacknowledged_ = 0;
      return true;
    case MessageId::hw_req_info:
      unacknowledged_ = 0;
      reply_info(now, out);
      return true;
    case MessageId::hw_start_updatemsgs:
      if (!next_update_) next_update_ = now + update_period;
      unacknowledged_ = 0;
      return true;
    case MessageId::hw_stop_updatemsgs:
      next_update_.reset();
      return true;
    case MessageId::hw_disconnect:
      forget_host();
      return true;
    case MessageId::mod_set_chanenablestate:
      enabled_ = message.param2 == 1;
      return true;
    case MessageId::mod_req_chanenablestate:
      reply_short(MessageId::mod_get_chanenablestate, 1, enabled_ ? 1 : 2, out);
      return true;
    case MessageId::mod_identify:
    case MessageId::set_eepromparams:
      return true;
    case MessageId::set_trigger:
      trigger_mode_ = message.param2;
      return true;
    case MessageId::req_trigger:
      reply_short(MessageId::get_trigger, 1, trigger_mode_, out);
      return true;
    default:
      return false;
  }
}

bool AptStageEmulator::handle_status(const Message& message, TimePoint now, ByteSink& out) {
  const bool requests =
      message.id == MessageId::req_statusbits ||
      message.id == (servo() ? MessageId::req_dcstatusupdate : MessageId::req_statusupdate);
  if (requests && active_fault(FaultKind::silent_status, now) != nullptr) return true;
  if (requests && active_fault(FaultKind::wrong_reply, now) != nullptr) {
    reply(MessageId::get_poscounter, ChannelCounts{1, counter(now)}, out);
    return true;
  }
  if (message.id == MessageId::ack_dcstatusupdate) {
    if (servo()) unacknowledged_ = 0;
    return servo();
  }
  if (!requests) return false;
  if (message.id == MessageId::req_statusbits)
    reply(MessageId::get_statusbits, StatusBits{1, status_bits(now)}, out);
  else
    reply_status(plus(message.id, 1), now, out);
  return true;
}

bool AptStageEmulator::handle_counters(const Message& message, TimePoint now, ByteSink& out) {
  const bool whole = servo();  // position and encoder share one counter
  const auto body = decode_body<ChannelCounts>(message.data);
  switch (message.id) {
    case MessageId::req_poscounter:
      reply(MessageId::get_poscounter, ChannelCounts{1, counter(now)}, out);
      return true;
    case MessageId::req_enccounter:
      reply(MessageId::get_enccounter, ChannelCounts{1, whole ? counter(now) : encoder(now)}, out);
      return true;
    case MessageId::set_poscounter:
      if (body) zero_ += length(counter(now)) - length(body->value_counts);
      return true;
    case MessageId::set_enccounter:
      if (!body) return true;
      if (whole)
        zero_ += length(counter(now)) - length(body->value_counts);
      else
        encoder_zero_counts_ += encoder(now) - body->value_counts;
      return true;
    default:
      return false;
  }
}

bool AptStageEmulator::handle_parameters(const Message& message, ByteSink& out) {
  const AptParameters::Answer answer = parameters_.handle(message);
  if (answer.outcome == AptParameters::Outcome::is_request) {
    buffer_.clear();
    append_long_header(buffer_, answer.reply, answer.body->size(), {host_, self_});
    buffer_.insert(buffer_.end(), answer.body->begin(), answer.body->end());
    out(buffer_);
  }
  return answer.outcome == AptParameters::Outcome::is_request ||
         answer.outcome == AptParameters::Outcome::taken;
}

void AptStageEmulator::reply_short(MessageId id, std::uint8_t param1, std::uint8_t param2,
                                   ByteSink& out) {
  buffer_.clear();
  append_short(buffer_, id, param1, param2, {host_, self_});
  out(buffer_);
}

/// Position counts per servo cycle: 205 at 100 mm/s with 20 000 counts/mm and 102.4 us, as in the
/// example of APT16; a moving command has 65536 times that (docs/reference/device-facts.md, APT
/// scales).
std::int16_t AptStageEmulator::velocity_counts(TimePoint now) const {
  constexpr double most = std::numeric_limits<std::int16_t>::max();
  const double per_s = stage().velocity(now) / si_per_unit(*params_.stage);
  const double counts = std::round(per_s * params_.stage->scale.velocity_counts / 65536);
  return static_cast<std::int16_t>(std::clamp(counts, -most, most));
}

/// The 14 bytes shared by status updates and ends of moves.
void AptStageEmulator::reply_status(MessageId id, TimePoint now, ByteSink& out) {
  if (servo())
    reply(id, DcStatusUpdate{1, counter(now), velocity_counts(now), 0, status_bits(now)}, out);
  else
    reply(id, StatusUpdate{1, counter(now), encoder(now), status_bits(now)}, out);
}

void AptStageEmulator::reply_info(TimePoint now, ByteSink& out) {
  const bool of_rack = params_.bay && self_ == address::rack;
  HardwareInfo info;
  info.serial = params_.serial;
  if (const Fault* wrong = active_fault(FaultKind::wrong_serial, now))
    info.serial += static_cast<std::int32_t>(wrong->amount);
  info.model = Text<8>::from(params_.model);
  info.hardware_type = of_rack       ? rack_hardware_type
                       : params_.bay ? card_hardware_type
                                     : kcube_hardware_type;
  info.firmware_major = params_.firmware[0];
  info.firmware_interim = params_.firmware[1];
  info.firmware_minor = params_.firmware[2];
  info.notes = Text<48>::from(params_.notes);
  info.stage_id = params_.stage->stage_id;
  info.hardware_version = 1;
  info.channels = of_rack ? params_.bays : 1;
  reply(MessageId::hw_get_info, info, out);
}

// Connections of the controller: bays, hub, digital outputs, analogue input.

using namespace protocols::apt;

namespace {

constexpr std::uint8_t occupied = 1, vacant = 2;
constexpr std::uint8_t off_the_hub = 0xFF;  // -1 (issue of December 2025, HUB_GET_BAYUSED)

}  // namespace

bool AptStageEmulator::handle_rack(const Message& message, ByteSink& out) {
  const bool to_rack = params_.bay && message.dest == address::rack;
  switch (message.id) {
    case MessageId::rack_req_bayused:
      reply_short(MessageId::rack_get_bayused, message.param1,
                  message.param1 == params_.bay.value_or(0) ? occupied : vacant, out);
      return true;
    case MessageId::hub_req_bayused:  // for cubes
      if (servo()) reply_short(MessageId::hub_get_bayused, off_the_hub, 0, out);
      return servo();
    case MessageId::rack_req_statusbits:
      if (to_rack) reply(MessageId::rack_get_statusbits, RackStatusBits{rack_outputs_}, out);
      return to_rack;
    case MessageId::rack_set_digoutputs:
      if (to_rack) rack_outputs_ = message.param1;
      return to_rack;
    case MessageId::rack_req_digoutputs:
      if (to_rack) reply_short(MessageId::rack_get_digoutputs, rack_outputs_, 0, out);
      return to_rack;
    default:
      return handle_inputs_and_outputs(message, out);
  }
}

/// Separate controllers have them; an LTS, with a built-in controller, has not (device-facts.md,
/// APT controllers).
bool AptStageEmulator::handle_inputs_and_outputs(const Message& message, ByteSink& out) {
  if (!lists_end_message_switch()) return false;
  switch (message.id) {
    case MessageId::mod_set_digoutputs:
      outputs_ = message.param1;
      return true;
    case MessageId::mod_req_digoutputs:
      reply_short(MessageId::mod_get_digoutputs, outputs_, 0, out);
      return true;
    case MessageId::req_adcinputs:  // nothing is connected
      reply(MessageId::get_adcinputs, AdcInputs{}, out);
      return true;
    default:
      return false;
  }
}

}  // namespace weft::sim
