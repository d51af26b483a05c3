// Lifecycle, commands and sent bytes. stage_status.cpp handles received bytes; stage_estimate.cpp
// decides which readings are accepted.
#include "drivers/thorlabs_apt/stage_driver.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace weft::drivers {
namespace {

using namespace protocols::apt;

constexpr Duration watch_period = std::chrono::milliseconds(250);
/// Shorter, because even a short homing must be seen to move.
constexpr Duration home_watch_period = std::chrono::milliseconds(50);
/// A stage in motion with a constant position for this duration is stuck.
constexpr Duration stall_limit = std::chrono::seconds(3);
/// At least once a second (APT16 p. 98).
constexpr Duration keep_alive_period = std::chrono::milliseconds(500);
/// Delay of a command to the stage on a slow link.
constexpr Duration command_latency = std::chrono::milliseconds(75);
constexpr std::uint8_t enable = 1;
constexpr auto stop_now = static_cast<std::uint8_t>(StopMode::immediate);
constexpr auto stop_profiled = static_cast<std::uint8_t>(StopMode::profiled);

tl::unexpected<Error> link_failed() {
  return fail({.code = Errc::io,
               .what = "command not sent: the link did not accept it",
               .hint = "Check cable and power of the device"});
}

}  // namespace

StageDriver::StageDriver(const StageSettings& settings, DriverHost& driver_host)
    : DriverBase(driver_host),
      settings_(settings),
      route_{settings.destination, address::host},
      opening_(driver_host.loop(), [this] { on_opening_timeout(); }),
      motion_limit_(driver_host.loop(), [this] { on_motion_timeout(); }),
      watch_(driver_host.loop(), [this] { on_watch(); }),
      poll_(driver_host.loop(), [this] { on_poll(); }),
      keep_alive_(driver_host.loop(), [this] { on_keep_alive(); }),
      reply_(driver_host.loop(), [this] { on_reply_timeout(); }) {}

Status StageDriver::open() noexcept {
  if (Status taken = attach(); !taken) return taken;
  splitter_.clear();
  last_ = {};
  motion_ = {};
  have_last_ = false;
  implausible_ = unwell_ = 0;
  found_limits_.reset();
  stops_under_way_ = unacknowledged_ = 0;
  // LTS units do not list 0x0018 (device-facts.md, APT controllers). The stop silences a unit that
  // a dead host left streaming.
  if (is_servo_family()) put_short(MessageId::hw_no_flash_programming, 0, 0);
  put_short(MessageId::hw_stop_updatemsgs, 0, 0);
  put_short(MessageId::hw_req_info, 0, 0);
  put_short(MessageId::req_limswitchparams, settings_.channel, 0);
  if (settings_.identify) put_short(MessageId::mod_identify, settings_.channel, 0);
  opening_.start(settings_.reply_timeout);
  if (!flush()) return link_failed();
  return {};
}

Status StageDriver::arm() noexcept {
  if (Status allowed = require(DriverState::open, "arm"); !allowed) return allowed;
  if (arming_)
    return fail({.code = Errc::wrong_state, .what = "arm refused: the driver is already arming"});
  arming_ = true;
  put_arming();
  put_status_request();
  if (!flush()) return link_failed();
  return {};
}

// SET messages have no answer: the status reply after them is the evidence.
void StageDriver::put_arming() {
  const std::uint16_t channel = settings_.channel;
  const StageModel& model = *settings_.model;
  put_short(MessageId::mod_set_chanenablestate, settings_.channel, enable);
  velocity_counts_ = 0;
  put_velocity(settings_.default_velocity_counts);
  HomeParams home{channel, model.home_direction, model.home_limit_switch, 0, 0};
  home.velocity_counts = velocity_to_counts(model.scale, model.home_speed).value_or(0);
  home.offset_counts = position_to_counts(model.scale, model.home_offset).value_or(0);
  append_message(out_, MessageId::set_homeparams, home, route_);
  LimitSwitchParams limits{channel, model.forward_limit, model.reverse_limit, 0, 0, 1};
  if (model.axis == Axis::rotary) limits.soft_mode |= 0x80;
  if (found_limits_) {  // keep soft limits that were set before
    limits.forward_soft_counts = found_limits_->forward_soft_counts;
    limits.reverse_soft_counts = found_limits_->reverse_soft_counts;
    limits.soft_mode = found_limits_->soft_mode;
  }
  append_message(out_, MessageId::set_limswitchparams, limits, route_);
  // Backlash correction would drive past each target of the force loop and return.
  append_message(out_, MessageId::set_genmoveparams, ChannelCounts{channel, 0}, route_);
  // An S-curve left in the controller brakes later than a trapezoid, for which all limits are
  // computed.
  if (!is_servo_family())
    append_message(out_, MessageId::set_bowindex, BowIndex{channel, 0}, route_);
  else if (model.is_brushless())
    append_message(out_, MessageId::set_pmdprofilemode, ProfileMode{channel, 0, 0, 0}, route_);
  if (lists_end_messages_) put_short(MessageId::resume_endofmovemsgs, settings_.channel, 0);
  put_short(MessageId::req_velparams, settings_.channel, 0);
  put_short(MessageId::req_limswitchparams, settings_.channel, 0);
}

Result<std::uint32_t> StageDriver::command(const Command& command) noexcept {
  if (Status allowed = require(DriverState::armed, "command"); !allowed)
    return pass(std::move(allowed.error()));
  return std::visit([this](const auto& c) { return run(c); }, command);
}

Result<std::uint32_t> StageDriver::run(const HomeCommand&) {
  const std::uint32_t id = begin(MotionKind::home, 0, settings_.home_timeout);
  put_short(MessageId::move_home, settings_.channel, 0);
  if (!flush()) return link_failed();
  return id;
}

Result<std::uint32_t> StageDriver::run(const MoveCommand& move) {
  if (Status homed = require_homed(); !homed && !move.unhomed)
    return pass(std::move(homed.error()));
  const Result<std::int32_t> velocity = speed_counts(move.speed);
  if (!velocity) return pass(velocity.error());
  const Result<std::int32_t> target = position_to_counts(settings_.scale, move.target);
  if (!target) return pass(target.error());
  const bool has_origin = (last_.status_bits & status::homed) != 0 || !move.unhomed;
  if (has_origin &&
      (*target < settings_.travel_low_counts || *target > settings_.travel_high_counts))
    return fail({.code = Errc::range,
                 .what = "target outside the travel",
                 .expected = settings_.with_unit(to_si(settings_.travel_low_counts)) + " to " +
                             settings_.with_unit(to_si(settings_.travel_high_counts)),
                 .got = settings_.with_unit(move.target)});
  const double distance = std::abs(move.target - to_si(last_.position_counts));
  const Duration limit = move_time_limit(distance, move.speed, settings_.acceleration, braking());
  note_speed(move.speed);
  const std::uint32_t id = begin(MotionKind::move, *target, limit);
  put_velocity(*velocity);
  put_absolute(*target);
  if (!flush()) return link_failed();
  return id;
}

Result<std::uint32_t> StageDriver::run(const ServoCommand& servo) {
  if (servo.velocity == 0) {  // a stop is never refused, neither for its horizon nor before homing
    if (!end_servo()) return link_failed();
    return 0;
  }
  if (Status homed = require_homed(); !homed) return pass(std::move(homed.error()));
  if (servo.horizon <= Duration::zero())
    return fail({.code = Errc::range,
                 .what = "horizon of a velocity command out of range",
                 .expected = "above 0 s"});
  const Result<std::int32_t> velocity = speed_counts(std::abs(servo.velocity));
  if (!velocity) return pass(velocity.error());
  const double reach_counts =
      servo.velocity * to_seconds(servo.horizon) * settings_.scale.counts_per_unit;
  const double target =
      std::clamp<double>(std::round(last_.position_counts + reach_counts),
                         settings_.travel_low_counts, settings_.travel_high_counts);
  note_speed(std::abs(servo.velocity));
  if (motion_.awaited()) end_motion();
  motion_.kind = MotionKind::servo;
  motion_.target_counts = static_cast<std::int32_t>(target);
  put_velocity(*velocity);
  put_absolute(motion_.target_counts);
  if (!flush()) return link_failed();
  return 0;
}

Result<std::uint32_t> StageDriver::run(const PollCommand&) {
  put_status_request();
  if (!flush()) return link_failed();
  return 0;
}

Result<std::uint32_t> StageDriver::run(const BiasCommand&) {
  return fail({.code = Errc::unsupported, .what = "bias not supported by a stage"});
}

// Before homing, positions have no origin and the travel limits cannot be checked.
Status StageDriver::require_homed() const {
  if (!settings_.require_homed || (last_.status_bits & status::homed) != 0) return {};
  return fail({.code = Errc::wrong_state,
               .what = "motion refused: stage not homed",
               .hint = "Home the stage first"});
}

/// A speed below one count is raised to one count, because it is not zero.
Result<std::int32_t> StageDriver::speed_counts(double speed) const {
  Result<std::int32_t> counts = velocity_to_counts(settings_.scale, speed);
  if (!counts) return counts;
  if (speed > 0 && *counts <= settings_.max_velocity_counts) return std::max(*counts, 1);
  return fail({.code = Errc::range,
               .what = "speed out of range",
               .expected = "above 0, at most " + settings_.with_unit(settings_.max_speed) + "/s",
               .got = settings_.with_unit(speed) + "/s"});
}

bool StageDriver::is_still() const {
  return motion_.kind == MotionKind::none && stops_under_way_ == 0 &&
         (last_.status_bits & status::any_motion) == 0;
}

// Several commands may have been sent while it brakes, so the last speed alone is not enough.
Braking StageDriver::braking() const {
  if (is_still()) return {};
  return drivers::braking(fastest_, settings_.acceleration, now() - last_at_ + command_latency);
}

void StageDriver::note_speed(double speed) {
  fastest_ = is_still() ? speed : std::max(fastest_, speed);
}

std::uint32_t StageDriver::begin(MotionKind kind, std::int32_t target_counts, Duration limit) {
  motion_ = {};
  motion_.kind = kind;
  motion_.id = ++last_id_;
  motion_.target_counts = target_counts;
  motion_.progress_counts = last_.position_counts;
  motion_.progress_at = now();
  motion_limit_.start(limit);
  watch_.start(kind == MotionKind::home ? home_watch_period : watch_period);
  return motion_.id;
}

void StageDriver::end_motion() {
  motion_ = {};
  motion_limit_.cancel();
  watch_.cancel();
}

// The latest status may be older than the last command. So a motion that we started counts as
// moving until the device reports its end.
bool StageDriver::end_servo() {
  const bool seen_moving = (last_.status_bits & status::any_motion) != 0 && stops_under_way_ == 0;
  if (motion_.kind == MotionKind::none && !seen_moving) return true;
  end_motion();
  ++stops_under_way_;
  put_short(MessageId::move_stop, settings_.channel, stop_profiled);
  return flush();
}

void StageDriver::stop() noexcept {
  if (!attached()) return;
  end_motion();
  ++stops_under_way_;
  put_short(MessageId::move_stop, settings_.channel, stop_now);
  flush();
}

void StageDriver::close() noexcept {
  cancel_timers();
  if (attached()) {
    out_.clear();
    if (state() == DriverState::armed) put_short(MessageId::move_stop, settings_.channel, stop_now);
    put_short(MessageId::hw_stop_updatemsgs, 0, 0);
    send_last(out_);
    out_.clear();
    splitter_.clear();
    detach();
  }
  enter(LifecycleEvent::close);
}

void StageDriver::make_safe() noexcept {
  cancel_timers();
  out_.clear();
  splitter_.clear();
  if (state() == DriverState::closed) return;  // the identity of the stage is unknown
  put_short(MessageId::move_stop, settings_.channel, stop_now);
  send_last(out_);
  out_.clear();
}

void StageDriver::cancel_timers() {
  end_motion();
  arming_ = false;
  opening_.cancel();
  poll_.cancel();
  keep_alive_.cancel();
  reply_.stop();
}

void StageDriver::on_opening_timeout() {
  raise({.code = Errc::timeout,
         .what = "no reply of the controller to HW_REQ_INFO",
         .expected = "a reply within " + std::to_string(to_seconds(settings_.reply_timeout)) + " s",
         .got = "nothing received",
         .hint = "Check the port, the destination address and the power"});
}

void StageDriver::on_reply_timeout() {
  raise({.code = Errc::timeout,
         .what = "no reply of the controller to status requests",
         .expected = "a reply within " + std::to_string(to_seconds(settings_.reply_timeout)) + " s",
         .got = "nothing received"});
}

std::string StageDriver::format_target() const {
  return motion_.kind == MotionKind::home ? std::string()
                                          : settings_.with_unit(to_si(motion_.target_counts));
}

void StageDriver::on_motion_timeout() {
  raise({.code = Errc::timeout,
         .what = motion_.kind == MotionKind::home ? "homing timed out" : "motion timed out",
         .expected = format_target(),
         .got = settings_.with_unit(to_si(last_.position_counts))});
}

void StageDriver::on_watch() {
  if (now() - motion_.progress_at > stall_limit) {
    raise({.code = Errc::device_motion,
           .what = "stage does not move",
           .expected = format_target(),
           .got = settings_.with_unit(to_si(last_.position_counts)),
           .hint = "Check for an obstacle, and check the limit switches"});
    return;
  }
  const Duration period = motion_.kind == MotionKind::home ? home_watch_period : watch_period;
  if (now() - last_at_ >= period) put_status_request();
  if (out_.empty() || flush()) watch_.start(period);
}

void StageDriver::on_poll() {
  put_status_request();
  if (flush()) poll_.start(settings_.poll_period);
}

void StageDriver::on_keep_alive() {
  put_short(MessageId::ack_dcstatusupdate, 0, 0);
  if (flush()) keep_alive_.start(keep_alive_period);
}

void StageDriver::put_short(MessageId id, std::uint8_t param1, std::uint8_t param2) {
  append_short(out_, id, param1, param2, route_);
}

void StageDriver::put_velocity(std::int32_t velocity_counts) {
  if (velocity_counts == velocity_counts_) return;
  velocity_counts_ = velocity_counts;
  append_message(
      out_, MessageId::set_velparams,
      VelocityParams{settings_.channel, 0, settings_.acceleration_counts, velocity_counts}, route_);
}

void StageDriver::put_absolute(std::int32_t target_counts) {
  append_message(out_, MessageId::move_absolute, ChannelCounts{settings_.channel, target_counts},
                 route_);
}

void StageDriver::put_status_request() {
  put_short(is_servo_family() ? MessageId::req_dcstatusupdate : MessageId::req_statusupdate,
            settings_.channel, 0);
  reply_.expect_reply_within(settings_.reply_timeout);
}

bool StageDriver::flush() {
  const bool sent = send(out_);
  out_.clear();
  return sent;
}

constinit const DriverEntry thorlabs_apt_entry{
    .name = "thorlabs_apt",
    .summary = "One Thorlabs stage behind an APT controller",
    .config_schema_json = stage_config_schema,
    .create = create_driver<StageDriver, read_stage_settings>,
};

}  // namespace weft::drivers
