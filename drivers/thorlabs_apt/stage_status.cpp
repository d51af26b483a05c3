// What comes in from the stage, and what follows from it.

#include <string>

#include "drivers/thorlabs_apt/identity.hpp"
#include "drivers/thorlabs_apt/stage_driver.hpp"

namespace weft::drivers {
namespace {

using namespace protocols::apt;

/// A servo controller goes silent after about 50 status messages without an answer (APT16 p. 98).
constexpr std::uint32_t acknowledge_every = 10;

std::string fault_names(std::uint32_t bits) {
  struct Name {
    std::uint32_t bit;
    std::string_view text;
  };
  static constexpr Name names[] = {
      {status::motion_error, "position error too large"},
      {status::instrument_error, "instrument error"},
      {status::over_temperature, "over-temperature"},
      {status::bus_voltage_fault, "bus voltage"},
      {status::commutation_error, "commutation"},
      {status::overload, "overload"},
      {status::encoder_fault, "encoder"},
      {status::over_current, "over-current"},
      {status::supply_current_fault, "supply current"},
      {status::error, "error"},
  };
  std::string out;
  for (const Name& name : names)
    if ((bits & name.bit) != 0) out += (out.empty() ? "" : ", ") + std::string(name.text);
  return out;
}

template <class Body>
std::optional<StageReading> reading_of(const Message& message, std::uint16_t channel) {
  const Result<Body> body = decode_body<Body>(message.data);
  if (!body || body->channel != channel) return std::nullopt;
  return StageReading{body->position_counts, body->status_bits};
}

}  // namespace

void StageDriver::received(ByteView bytes, TimePoint arrival) {
  splitter_.push(bytes);
  while (attached() && splitter_.next(message_))
    if (message_.source == route_.dest) handle(message_, arrival);
}

void StageDriver::handle(const Message& message, TimePoint arrival) {
  switch (message.id) {
    case MessageId::get_statusupdate:
    case MessageId::get_dcstatusupdate:
      return on_status(message, arrival);
    case MessageId::move_completed:
      return on_completed(message, arrival);
    case MessageId::move_stopped:
      return on_stopped(message, arrival);
    case MessageId::move_homed:
      return on_homed();
    case MessageId::hw_get_info:
      return on_info(message);
    case MessageId::hw_richresponse:
      return on_rich_response(message);
    case MessageId::hw_response:
      return raise({Errc::device, "the controller reports a fault without a text", {}, {}, {}, {}});
    default:
      return;
  }
}

void StageDriver::on_info(const Message& message) {
  if (state() != DriverState::closed) return;
  const Result<HardwareInfo> info = decode_body<HardwareInfo>(message.data);
  if (!info) return;
  opening_.cancel();
  if (Status same = check_identity(settings_, *info); !same) {
    raise(std::move(same.error()));
    return;
  }
  host().identified(identity_of(settings_, *info));
  enter(LifecycleEvent::opened);
}

void StageDriver::on_rich_response(const Message& message) {
  const Result<RichResponse> response = decode_body<RichResponse>(message.data);
  raise({Errc::device,
         "the controller reports a fault: " +
             (response ? response->notes.str() : std::string("unreadable")),
         {},
         {},
         response ? "code " + std::to_string(response->code) : std::string(),
         {}});
}

std::optional<StageReading> StageDriver::read_status(const Message& message) const {
  return is_servo_family() ? reading_of<DcStatusUpdate>(message, settings_.channel)
                           : reading_of<StatusUpdate>(message, settings_.channel);
}

void StageDriver::on_status(const Message& message, TimePoint arrival) {
  const bool of_our_family = is_servo_family() == (message.id == MessageId::get_dcstatusupdate);
  const std::optional<StageReading> reading = read_status(message);
  if (!of_our_family || !reading || !accept(*reading, arrival)) return;
  confirm((reading->status_bits & status::any_motion) == 0);
  publish(arrival);
  acknowledge();
}

void StageDriver::on_completed(const Message& message, TimePoint arrival) {
  if (motion_.kind == MotionKind::move) motion_.reported = true;
  const std::optional<StageReading> reading = read_status(message);
  if (reading) {
    if (!accept(*reading, arrival)) return;
    confirm(true);
    publish(arrival);
    acknowledge();
  }
  // The end of a move that was replaced, or the short form that APT16's figure shows: look again.
  if (attached() && motion_.kind == MotionKind::move) {
    put_status_request();
    flush();
  }
}

void StageDriver::on_stopped(const Message& message, TimePoint arrival) {
  const std::optional<StageReading> reading = read_status(message);
  if (!reading || !accept(*reading, arrival)) return;
  if (stops_under_way_ > 0) {
    --stops_under_way_;
  } else if (motion_.awaited()) {
    raise({Errc::device,
           "the stage stopped before its target",
           {},
           std::to_string(motion_.target_counts) + " counts",
           std::to_string(reading->position_counts) + " counts",
           "Look at the limit switches and at the travel in the rig file"});
    return;
  } else {
    motion_ = {};
  }
  publish(arrival);
  acknowledge();
}

void StageDriver::on_homed() {
  if (motion_.kind != MotionKind::home) return;
  motion_.reported = true;  // believed when the next status has the homed bit
  put_status_request();
  flush();
}

/// Takes a reading in. False when it ended in a fault or before the driver is armed.
bool StageDriver::accept(const StageReading& reading, TimePoint arrival) {
  if (state() == DriverState::closed) return false;
  last_ = reading;
  last_at_ = arrival;
  reply_.satisfy();
  if ((reading.status_bits & status::any_fault) != 0) {
    raise({Errc::device,
           "the controller reports a fault: " + fault_names(reading.status_bits),
           {},
           {},
           "status " + std::to_string(reading.status_bits),
           {}});
    return false;
  }
  if (arming_ && !finish_arming(reading)) return false;
  const bool at_rest = (reading.status_bits & status::any_motion) == 0;
  if (motion_.kind == MotionKind::none && at_rest) stops_under_way_ = 0;
  motion_.note_progress(reading.position_counts, arrival);
  return true;
}

bool StageDriver::finish_arming(const StageReading& reading) {
  arming_ = false;
  if ((reading.status_bits & status::channel_enabled) == 0) {
    raise({Errc::device,
           "the channel did not become enabled",
           {},
           {},
           {},
           "Look at the controller's front panel"});
    return false;
  }
  if (settings_.poll_period > Duration::zero()) poll_.start(settings_.poll_period);
  if (is_servo_family()) on_keep_alive();
  enter(LifecycleEvent::armed);
  return state() == DriverState::armed;
}

/// Done needs evidence: the device's own report, and a position that agrees.
void StageDriver::confirm(bool device_says_at_rest) {
  const bool arrived = motion_.at_target(last_.position_counts, settings_.in_position_counts);
  if (motion_.kind == MotionKind::servo && device_says_at_rest && arrived) motion_ = {};
  if (!motion_.reported || !device_says_at_rest) return;
  if (motion_.kind == MotionKind::home) return confirm_home();
  if (!arrived) return;
  confirmed_id_ = motion_.id;
  end_motion();
}

void StageDriver::confirm_home() {
  if ((last_.status_bits & status::homed) == 0) {
    raise({Errc::device, "homing ended without the homed status", {}, {}, {}, {}});
    return;
  }
  confirmed_id_ = motion_.id;
  end_motion();
}

void StageDriver::publish(TimePoint arrival) {
  if (state() != DriverState::armed) return;
  const std::uint32_t bits = last_.status_bits;
  Sample sample;
  sample.host = arrival;
  sample.sequence = sequence_++;
  sample.value = StageSample{.position = to_si(last_.position_counts),
                             .moving = (bits & status::any_motion) != 0,
                             .homed = (bits & status::homed) != 0,
                             .limit = (bits & status::any_limit) != 0,
                             .move_id = confirmed_id_};
  host().publish(sample);
}

void StageDriver::acknowledge() {
  if (!attached() || !is_servo_family() || ++unacknowledged_ < acknowledge_every) return;
  unacknowledged_ = 0;
  put_short(MessageId::ack_dcstatusupdate, 0, 0);
  flush();
}

}  // namespace weft::drivers
