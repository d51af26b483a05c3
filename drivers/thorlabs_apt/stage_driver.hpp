#pragma once
// The state machine of one stage and its current motion. A motion is done if the device reports it
// and the position agrees.

#include <cstdint>
#include <cstdlib>
#include <optional>

#include "drivers/api/driver.hpp"
#include "drivers/api/driver_base.hpp"
#include "drivers/api/timer.hpp"
#include "drivers/thorlabs_apt/settings.hpp"
#include "protocols/apt/bodies.hpp"
#include "protocols/apt/stage_scale.hpp"

namespace weft::drivers {

/// The content of a status message of either family.
struct StageReading {
  std::int32_t position_counts = 0;
  std::uint32_t status_bits = 0;
  std::int32_t encoder_counts = 0;  ///< steppers only
};

enum class MotionKind : std::uint8_t { none, home, move, servo };

struct Motion {
  MotionKind kind = MotionKind::none;
  std::uint32_t id = 0;
  std::int32_t target_counts = 0;
  bool reported = false;  ///< the device sent MOVE_COMPLETED or MOVE_HOMED

  // Position and time of the last change of position.
  std::int32_t progress_counts = 0;
  TimePoint progress_at{};
  bool moved = false;   ///< the position has changed
  bool homing = false;  ///< a status had the homing bit

  // Start of rest by the status: at the target without a report, or reported but away from the
  // target.
  std::optional<TimePoint> silent_since, away_since;

  [[nodiscard]] bool awaited() const {
    return kind == MotionKind::move || kind == MotionKind::home;
  }
  [[nodiscard]] bool at_target(std::int32_t position_counts, std::int32_t tolerance_counts) const {
    return std::llabs(std::int64_t{position_counts} - target_counts) <= tolerance_counts;
  }
  void note_progress(std::int32_t position_counts, TimePoint at) {
    if (position_counts == progress_counts) return;
    progress_counts = position_counts;
    progress_at = at;
    moved = true;
  }
};

/// If the host was delayed, a reading may be older than its arrival by up to this. It is never
/// older than the previous arrival. A longer delay ends the run: the guard of the scan cycle has
/// the same limit (GuardLimits::cycle_max_lateness).
inline constexpr Duration longest_wait = std::chrono::milliseconds(250);

/// Distance and time in which a moving stage brakes before it turns to another target.
struct Braking {
  double way = 0;
  double time_s = 0;
};

/// Braking from `speed`, after the time `unheard` in which the command has not reached the stage.
/// In SI.
constexpr Braking braking(double speed, double acceleration, Duration unheard) {
  const double ramp_s = speed / acceleration;
  return {speed * (to_seconds(unheard) + 0.5 * ramp_s), to_seconds(unheard) + ramp_s};
}

/// Time limit of a trapezoidal move over `distance`: its ideal time d/v + v/a, plus half of it,
/// plus two seconds for the controller to settle. The braking `before` may lead the stage away from
/// its target. Arguments are positive, in SI.
constexpr Duration move_time_limit(double distance, double speed, double acceleration,
                                   const Braking& before = {}) {
  const double way_s = (distance + before.way) / speed;
  return from_seconds(1.5 * (before.time_s + way_s + speed / acceleration) + 2.0);
}

/// Driver for one Thorlabs stage behind an APT controller; see README.md.
extern const DriverEntry thorlabs_apt_entry;

/// One stage on one link. Motion commands are finite and have a time limit. In steady state neither
/// a command nor a status message allocates.
class StageDriver final : public DriverBase {
 public:
  StageDriver(const StageSettings& settings, DriverHost& driver_host);

  Status open() noexcept override;
  Status arm() noexcept override;
  /// Errors: wrong_state (not armed, not homed), range (target, speed, horizon), unsupported.
  Result<std::uint32_t> command(const Command& command) noexcept override;
  /// Stops at once; stays armed so that the stage can leave the contact.
  void stop() noexcept override;
  void close() noexcept override;

 private:
  using MessageId = protocols::apt::MessageId;

  void received(ByteView bytes, TimePoint arrival) override;
  void make_safe() noexcept override;

  Result<std::uint32_t> run(const HomeCommand&);
  Result<std::uint32_t> run(const MoveCommand& move);
  Result<std::uint32_t> run(const ServoCommand& servo);
  Result<std::uint32_t> run(const PollCommand&);
  Result<std::uint32_t> run(const BiasCommand&);
  Status require_homed() const;
  Result<std::int32_t> speed_counts(double speed) const;
  std::uint32_t begin(MotionKind kind, std::int32_t target_counts, Duration limit);
  void end_motion();
  bool end_servo();
  /// Whether the stage is at rest, by its status and by the commands since then.
  [[nodiscard]] bool is_still() const;
  /// Braking before a command sent now takes effect.
  [[nodiscard]] Braking braking() const;
  void note_speed(double speed);

  void handle(const protocols::apt::Message& message, TimePoint arrival);
  void on_info(const protocols::apt::Message& message);
  void on_completed(const protocols::apt::Message& message, TimePoint arrival);
  void on_stopped(const protocols::apt::Message& message, TimePoint arrival);
  void on_homed();
  void on_status(const protocols::apt::Message& message, TimePoint arrival);
  void on_rich_response(const protocols::apt::Message& message);
  std::optional<StageReading> read_status(const protocols::apt::Message& message) const;
  bool accept(const StageReading& reading, TimePoint arrival);
  bool plausible(const StageReading& reading, TimePoint arrival);
  std::optional<Error> ailment(const StageReading& reading) const;
  bool believed(const StageReading& reading);
  void on_limit_switches(const protocols::apt::Message& message);
  void on_velocity(const protocols::apt::Message& message);
  bool finish_arming(const StageReading& reading);
  void stop_found_motion();
  void confirm(bool device_is_at_rest, TimePoint arrival);
  void check_rest(bool arrived, TimePoint arrival);
  void check_home_rest(TimePoint arrival);
  void confirm_home();
  void publish(TimePoint arrival);
  void acknowledge();

  void on_opening_timeout();
  void on_reply_timeout();
  void on_motion_timeout();
  void on_watch();
  void on_poll();
  void on_keep_alive();

  void put_short(MessageId id, std::uint8_t param1, std::uint8_t param2);
  void put_velocity(std::int32_t velocity_counts);
  void put_arming();
  void put_absolute(std::int32_t target_counts);
  void put_status_request();
  bool flush();
  void cancel_timers();

  /// Text of the target; empty for homing, which ends at a switch.
  [[nodiscard]] std::string format_target() const;
  [[nodiscard]] double to_si(std::int32_t counts) const {
    return counts / settings_.scale.counts_per_unit;
  }
  [[nodiscard]] bool is_servo_family() const {
    return settings_.family == protocols::apt::Family::servo;
  }

  StageSettings settings_;
  protocols::apt::Route route_;
  protocols::apt::Splitter splitter_;
  protocols::apt::Message message_;
  Bytes out_;

  StageReading last_;
  TimePoint last_at_{};     ///< arrival of last_
  TimePoint last_since_{};  ///< earliest possible time of last_
  bool have_last_ = false;  ///< last_ is valid: the next reading must be near it
  int implausible_ = 0;     ///< readings in a row
  int unwell_ = 0;          ///< readings in a row that show a problem
  std::optional<protocols::apt::LimitSwitchParams> found_limits_;  ///< as found before arming
  Motion motion_;
  std::uint32_t last_id_ = 0;
  std::uint32_t confirmed_id_ = 0;
  std::uint32_t sequence_ = 0;
  std::int32_t velocity_counts_ = 0;  ///< last value sent to the controller
  double fastest_ = 0;                ///< fastest speed sent since it was at rest [m/s] or [rad/s]
  std::uint32_t stops_under_way_ = 0;
  std::uint32_t unacknowledged_ = 0;
  bool arming_ = false;
  bool lists_end_messages_ = false;  ///< the controller supports resume_endofmovemsgs

  Timer opening_;
  Timer motion_limit_;
  Timer watch_;
  Timer poll_;
  Timer keep_alive_;
  Watchdog reply_;
};

}  // namespace weft::drivers
