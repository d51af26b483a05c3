// Handles the messages from the stage.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <type_traits>

#include "drivers/thorlabs_apt/settings.hpp"
#include "drivers/thorlabs_apt/stage_driver.hpp"

namespace weft::drivers {
namespace {

using namespace protocols::apt;

/// A servo controller stops sending after about 50 unacknowledged status messages (APT16 p. 98).
constexpr std::uint32_t acknowledge_every = 10;
/// A stage at rest at its target for lost_report_limit has arrived: its report was lost. A stage
/// that reported the end but rests elsewhere for away_limit has not arrived.
constexpr Duration lost_report_limit = std::chrono::seconds(1);
constexpr Duration away_limit = std::chrono::milliseconds(500);
/// Relative tolerance of a speed that was read back.
constexpr double read_back_tolerance = 1e-6;

template <class Body>
std::optional<StageReading> reading_of(const Message& message, std::uint16_t channel) {
  const Result<Body> body = decode_body<Body>(message.data);
  if (!body || body->channel != channel) return std::nullopt;
  StageReading reading{body->position_counts, body->status_bits, 0};
  if constexpr (std::is_same_v<Body, StatusUpdate>) reading.encoder_counts = body->encoder_counts;
  return reading;
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
    case MessageId::get_limswitchparams:
      return on_limit_switches(message);
    case MessageId::get_velparams:
      return on_velocity(message);
    case MessageId::hw_richresponse:
      return on_rich_response(message);
    case MessageId::hw_response:
      return raise(
          {.code = Errc::device, .what = "fault without a text reported by the controller"});
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
  // The LTS does not list the message (device-facts.md, APT controllers).
  lists_end_messages_ = !info->model.str().starts_with("LTS");
  host().identified(identity_of(settings_, *info));
  enter(LifecycleEvent::opened);
}

/// On open(): soft limits inside the rig file's travel would stop the stage there. On arm(): the
/// limit switches read back must equal those that were set.
void StageDriver::on_limit_switches(const Message& message) {
  const auto found = decode_body<LimitSwitchParams>(message.data);
  if (!found || state() == DriverState::closed) return;
  if (arming_) {
    const StageModel& model = *settings_.model;
    if (found->forward_hardware == model.forward_limit &&
        found->reverse_hardware == model.reverse_limit)
      return;
    return raise({.code = Errc::device_refused,
                  .what = "limit switches of the stage not stored in the controller",
                  .expected = std::to_string(model.forward_limit) + ", " +
                              std::to_string(model.reverse_limit),
                  .got = std::to_string(found->forward_hardware) + ", " +
                         std::to_string(found->reverse_hardware),
                  .hint = "Check the stage in the rig file"});
  }
  found_limits_ = *found;
  const bool active = (found->soft_mode & 0x7F) > 1;
  if (!active || (found->reverse_soft_counts <= settings_.travel_low_counts &&
                  found->forward_soft_counts >= settings_.travel_high_counts))
    return;
  raise({.code = Errc::device_settings,
         .where = "/travel_" + std::string(settings_.model->axis == Axis::linear ? "mm" : "deg"),
         .what = "soft limits of the controller narrower than the travel in the rig file",
         .expected = settings_.with_unit(to_si(settings_.travel_low_counts)) + " to " +
                     settings_.with_unit(to_si(settings_.travel_high_counts)),
         .got = settings_.with_unit(to_si(found->reverse_soft_counts)) + " to " +
                settings_.with_unit(to_si(found->forward_soft_counts)),
         .hint = "Correct the rig file, or widen the limits with the program of the manufacturer"});
}

void StageDriver::on_velocity(const Message& message) {
  const auto device_params = decode_body<VelocityParams>(message.data);
  if (!device_params || !arming_) return;
  const auto refuse = [this](const std::string& what, std::int32_t sent, std::int32_t stored) {
    raise({.code = Errc::device_refused,
           .what = what + " of the rig file not stored in the controller",
           .expected = std::to_string(sent) + " counts",
           .got = std::to_string(stored) + " counts",
           .hint = "Lower the " + what + " in the rig file to the limit of the controller"});
  };
  // A controller with internal units may round: by one count, or by more for a speed, which has
  // hundreds of millions of counts.
  const auto differ = [](double sent, double stored) {
    return std::abs(sent - stored) > std::max(1.0, read_back_tolerance * sent);
  };
  if (differ(velocity_counts_, device_params->maximum_velocity_counts))
    return refuse("speed", velocity_counts_, device_params->maximum_velocity_counts);
  if (differ(settings_.acceleration_counts, device_params->acceleration_counts))
    refuse("acceleration", settings_.acceleration_counts, device_params->acceleration_counts);
}

void StageDriver::on_rich_response(const Message& message) {
  const Result<RichResponse> response = decode_body<RichResponse>(message.data);
  raise({.code = Errc::device,
         .what = "fault reported by the controller: " +
                 (response ? response->notes.str() : std::string("unreadable")),
         .got = response ? "code " + std::to_string(response->code) : std::string()});
}

std::optional<StageReading> StageDriver::read_status(const Message& message) const {
  return is_servo_family() ? reading_of<DcStatusUpdate>(message, settings_.channel)
                           : reading_of<StatusUpdate>(message, settings_.channel);
}

void StageDriver::on_status(const Message& message, TimePoint arrival) {
  const bool of_our_family = is_servo_family() == (message.id == MessageId::get_dcstatusupdate);
  const std::optional<StageReading> reading = read_status(message);
  if (!of_our_family || !reading) return;
  reply_.satisfy();  // reports of ends do not: they are spontaneous
  if (!accept(*reading, arrival)) return;
  confirm((reading->status_bits & status::any_motion) == 0, arrival);
  if (!attached()) return;
  publish(arrival);
  acknowledge();
}

void StageDriver::on_completed(const Message& message, TimePoint arrival) {
  if (motion_.kind == MotionKind::move) motion_.reported = true;
  const std::optional<StageReading> reading = read_status(message);
  if (reading) {
    if (!accept(*reading, arrival)) return;
    confirm(true, arrival);
    if (!attached()) return;
    publish(arrival);
    acknowledge();
  }
  // This may be the end of a replaced move, or the short form of APT16's figure: request a status.
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
    raise({.code = Errc::device_motion,
           .what = "stage stopped before its target",
           .expected = std::to_string(motion_.target_counts) + " counts",
           .got = std::to_string(reading->position_counts) + " counts",
           .hint = "Check the limit switches and the travel in the rig file"});
    return;
  } else {
    motion_ = {};
  }
  publish(arrival);
  acknowledge();
}

void StageDriver::on_homed() {
  if (motion_.kind != MotionKind::home) return;
  motion_.reported = true;  // confirmed when the next status has the homed bit
  put_status_request();
  flush();
}

/// Stores a reading. False if it ended in a fault, was rejected, or arrived before the driver is
/// armed.
bool StageDriver::accept(const StageReading& reading, TimePoint arrival) {
  if (state() == DriverState::closed) return false;
  if (!plausible(reading, arrival) || !believed(reading)) return false;
  last_ = reading;
  // It was sent after the previous one had arrived.
  last_since_ = have_last_ ? std::max(last_at_, arrival - longest_wait) : arrival;
  last_at_ = arrival;
  have_last_ = motion_.kind != MotionKind::home;  // homing moves the origin
  if (arming_ && !finish_arming(reading)) return false;
  const bool at_rest = (reading.status_bits & status::any_motion) == 0;
  if (motion_.kind == MotionKind::none && at_rest) stops_under_way_ = 0;
  motion_.note_progress(reading.position_counts, arrival);
  motion_.homing = motion_.homing || (reading.status_bits & status::homing) != 0;
  return true;
}

bool StageDriver::finish_arming(const StageReading& reading) {
  arming_ = false;
  if ((reading.status_bits & status::channel_enabled) == 0) {
    raise({.code = Errc::device_refused,
           .what = "channel not enabled",
           .hint = "Check the front panel of the controller"});
    return false;
  }
  if ((reading.status_bits & status::any_motion) != 0) stop_found_motion();
  if (!attached()) return false;
  if (settings_.poll_period > Duration::zero()) poll_.start(settings_.poll_period);
  if (is_servo_family()) on_keep_alive();
  enter(LifecycleEvent::armed);
  return state() == DriverState::armed;
}

/// A dead host, or a person at the panel, may have left the stage moving towards a limit.
void StageDriver::stop_found_motion() {
  host().log(LogLevel::warning, "stage was moving when it was armed; stop sent");
  ++stops_under_way_;
  put_short(MessageId::move_stop, settings_.channel, static_cast<std::uint8_t>(StopMode::profiled));
  flush();
}

/// A motion is done only with the device's own report and a position that agrees.
void StageDriver::confirm(bool device_is_at_rest, TimePoint arrival) {
  const bool arrived = motion_.at_target(last_.position_counts, settings_.in_position_counts);
  if (motion_.kind == MotionKind::servo && device_is_at_rest && arrived) motion_ = {};
  if (!device_is_at_rest) {
    motion_.silent_since.reset();
    motion_.away_since.reset();
    return;
  }
  if (motion_.kind == MotionKind::move) check_rest(arrived, arrival);
  if (motion_.kind == MotionKind::home) check_home_rest(arrival);
  if (!attached() || !motion_.reported) return;
  if (motion_.kind == MotionKind::home) return confirm_home();
  if (!arrived) return;
  confirmed_id_ = motion_.id;
  end_motion();
}

/// Handles a move with the stage at rest. The report of its end may have been lost, but the
/// repeated status has not.
void StageDriver::check_rest(bool arrived, TimePoint arrival) {
  std::optional<TimePoint>& since = arrived ? motion_.silent_since : motion_.away_since;
  (arrived ? motion_.away_since : motion_.silent_since).reset();
  if (arrived == motion_.reported) {
    since.reset();
    return;
  }
  if (!since) since = arrival;
  if (arrived && arrival - *since > lost_report_limit) {
    host().log(LogLevel::warning, "end of a move not reported; taken from the status");
    motion_.reported = true;
  }
  if (arrived || arrival - *since <= away_limit) return;
  raise({.code = Errc::device_motion,
         .what = "stage ended away from its target",
         .expected = std::to_string(motion_.target_counts) + " counts",
         .got = std::to_string(last_.position_counts) + " counts",
         .hint = "Check the backlash correction and the stage"});
}

/// Handles a homing with the stage at rest, homed, at the end position of homing, and seen to home:
/// its report may also have been lost.
void StageDriver::check_home_rest(TimePoint arrival) {
  const StageModel& model = *settings_.model;
  const std::int32_t offset = position_to_counts(model.scale, model.home_offset).value_or(0);
  const bool homed = (last_.status_bits & status::homed) != 0 &&
                     std::abs(last_.position_counts) <= offset + settings_.in_position_counts;
  if (motion_.reported || !homed || !(motion_.homing || motion_.moved)) {
    motion_.silent_since.reset();
    return;
  }
  if (!motion_.silent_since) motion_.silent_since = arrival;
  if (arrival - *motion_.silent_since <= lost_report_limit) return;
  host().log(LogLevel::warning, "end of homing not reported; taken from the status");
  motion_.reported = true;
}

void StageDriver::confirm_home() {
  if ((last_.status_bits & status::homed) == 0) {
    raise({.code = Errc::device_motion, .what = "homing ended without the homed status"});
    return;
  }
  if (settings_.home_must_move && !motion_.moved) {
    raise({.code = Errc::device_motion,
           .what = "homing reported as done, but the encoder did not move",
           .got = std::to_string(last_.position_counts) + " counts throughout",
           .hint = "Check the motor cable and the home switch"});
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
