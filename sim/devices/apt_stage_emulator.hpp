#pragma once
// A Thorlabs stage behind its APT controller: stepper family (LTS150, status 0x0481), DC servo and
// brushless family (PRM1-Z8 on KDC101, DDS220 on KBD101, status 0x0491). Source:
// docs/reference/device-facts.md.

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "protocols/apt/bodies.hpp"
#include "protocols/apt/stage_scale.hpp"
#include "protocols/base/time.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/devices/emulator.hpp"

namespace weft::sim {

/// Factor from the units of the APT tables (mm, degrees) to those of the plant (m, rad).
constexpr double si_per_unit(const protocols::apt::StageModel& model) {
  return model.axis == protocols::apt::Axis::linear ? m_per_mm : rad_per_deg;
}

/// The parameters that an APT controller keeps: message bodies are stored and returned on request.
class AptParameters {
 public:
  /// Starts with the defaults of the stage database.
  explicit AptParameters(const protocols::apt::StageModel& model);

  enum class Outcome : std::uint8_t {
    unknown,    ///< no parameter message
    taken,      ///< a SET
    refused,    ///< a SET with a body of another length than documented
    is_request  ///< a REQ: answer with `reply`
  };
  struct Answer {
    Outcome outcome = Outcome::unknown;
    protocols::apt::MessageId reply{};
    const Bytes* body = nullptr;
  };
  Answer handle(const protocols::apt::Message& message);

  /// Body by the id of the SET message, which must exist. All messages with a struct exist.
  template <class Body>
  [[nodiscard]] Body body(protocols::apt::MessageId set) const {
    return protocols::apt::decode_body<Body>(stored_.at(set)).value();
  }
  /// body() of set_limswitchparams, decoded once because each status needs it.
  [[nodiscard]] const protocols::apt::LimitSwitchParams& limits() const { return limits_; }

 private:
  std::map<protocols::apt::MessageId, Bytes> stored_;  ///< by the id of the SET message
  protocols::apt::LimitSwitchParams limits_;
};

/// Effect of a move command during a move. APT16 does not specify it, so it can be chosen.
enum class RetargetPolicy : std::uint8_t {
  replan,  ///< move to the new target at once, from the present velocity
  ignore,  ///< complete the current move
};

struct AptStageParams {
  AxisId axis = AxisId::x;
  const protocols::apt::StageModel* stage = nullptr;  ///< scale, limits and defaults
  std::string model = "LTS150";                       ///< of the controller, at most 8 characters
  std::int32_t serial = 45000001;
  /// Direction of MOVE_VELOCITY and MOVE_JOG that increases the counts, 1 or 2; 0: default of this
  /// controller model.
  std::uint8_t positive_direction = 0;
  std::array<std::uint8_t, 3> firmware{1, 2, 3};  ///< major, interim, minor
  std::string notes = "Weft emulator";
  /// Bay of the card, from 0, in a rack of `bays`; nullopt: a unit with one channel of its own.
  std::optional<std::uint8_t> bay;
  std::uint8_t bays = 3;
  bool enabled = true;   ///< state of the channel at power-on
  bool homed = false;    ///< at power-on the controller is already homed
  bool encoder = false;  ///< steppers: the status has the carriage position beside the step count
  RetargetPolicy retarget = RetargetPolicy::replan;
  /// Servos and BSC fall silent after this number of unsolicited status messages, servos until they
  /// are acknowledged (APT16 p. 98); 0 disables this.
  std::uint32_t silent_after = 50;
};

class AptStageEmulator final : public Emulator {
 public:
  /// Powered on. Unless params.homed, the counter is zero at the present carriage position.
  /// `bench_plant` must outlive the emulator.
  AptStageEmulator(const AptStageParams& params, BenchPlant& bench_plant, TimePoint now);

  void receive(ByteView bytes, TimePoint now, ByteSink& out) override;
  [[nodiscard]] std::optional<TimePoint> next_wakeup() const override;
  void wake(TimePoint now, ByteSink& out) override;
  void meet_new_host() override;

  /// Messages for another unit, unknown messages, and bodies of the wrong length.
  [[nodiscard]] std::uint64_t ignored() const { return ignored_; }

 private:
  using Message = protocols::apt::Message;
  using MessageId = protocols::apt::MessageId;
  enum class Motion : std::uint8_t { none, home, home_run_off, move, jog, stopping };

  // messages
  [[nodiscard]] bool is_for_us(std::uint8_t destination) const;
  void handle(const Message& message, TimePoint now, ByteSink& out);
  bool handle_system(const Message& message, TimePoint now, ByteSink& out);
  bool handle_rack(const Message& message, ByteSink& out);
  bool handle_inputs_and_outputs(const Message& message, ByteSink& out);
  bool handle_motion(const Message& message, TimePoint now, ByteSink& out);
  bool handle_status(const Message& message, TimePoint now, ByteSink& out);
  [[nodiscard]] bool lists(MessageId id) const;
  bool handle_counters(const Message& message, TimePoint now, ByteSink& out);
  bool handle_parameters(const Message& message, ByteSink& out);
  void reply_short(MessageId id, std::uint8_t param1, std::uint8_t param2, ByteSink& out);
  template <class Body>
  void reply(MessageId id, const Body& body, ByteSink& out) {
    buffer_.clear();
    append_message(buffer_, id, body, {host_, self_});
    out(buffer_);
  }
  void reply_status(MessageId id, TimePoint now, ByteSink& out);
  void reply_info(TimePoint now, ByteSink& out);
  void send_update(TimePoint now, ByteSink& out);
  void send_end(MessageId id, TimePoint now, ByteSink& out);
  bool can_send_unsolicited();
  void forget_host();

  // motion
  void home(TimePoint now, ByteSink& out);
  void home_to(double target, Motion leg, TimePoint now);
  bool move(const Message& message, bool relative, TimePoint now);
  void jog(const Message& message, TimePoint now);
  void move_to(double target, const MotionLimits& limits, Motion kind, TimePoint now);
  void plan(double target, const MotionLimits& limits, TimePoint now);
  void run_towards_limit(std::uint8_t direction, const MotionLimits& limits, Motion kind,
                         TimePoint now);
  void stop(const Message& message, TimePoint now);
  void finish_motion(TimePoint at, ByteSink& out);
  void send_end_of_motion(MessageId id, TimePoint at, ByteSink& out);
  void apply_motion_faults(TimePoint now, ByteSink& out);
  void apply_stall_faults(TimePoint now);
  [[nodiscard]] bool end_awaited() const { return motion_ != Motion::none && !held_ && !hung_; }
  [[nodiscard]] MotionLimits limits() const;
  [[nodiscard]] MotionLimits jog_limits() const;
  [[nodiscard]] MotionLimits home_limits() const;
  [[nodiscard]] double home_position() const;
  [[nodiscard]] bool homes_at_high_end() const;
  [[nodiscard]] bool increases_counts(std::uint8_t direction) const;
  [[nodiscard]] double inside_soft_limits(double target) const;

  // counters and status
  [[nodiscard]] double length(std::int32_t counts) const;  ///< counts as a way, [m] or [rad]
  [[nodiscard]] std::int32_t counts_at(double position) const;
  [[nodiscard]] double believed(TimePoint now) const;
  [[nodiscard]] std::int32_t counter(TimePoint now) const;
  [[nodiscard]] std::int32_t encoder(TimePoint now) const;
  [[nodiscard]] std::int16_t velocity_counts(TimePoint now) const;
  [[nodiscard]] std::uint32_t status_bits(TimePoint now) const;
  [[nodiscard]] std::uint32_t motion_bits(TimePoint now) const;
  [[nodiscard]] std::uint32_t limit_bits(TimePoint now) const;
  [[nodiscard]] bool servo() const;
  [[nodiscard]] bool lists_end_message_switch() const;
  [[nodiscard]] const Stage& stage() const;

  AptStageParams params_;
  BenchPlant* bench_plant_;
  AptParameters parameters_;
  protocols::apt::Splitter splitter_{protocols::apt::LineEnd::controller};
  std::optional<TimePoint> begun_;  ///< when the first byte of the incomplete message arrived
  Message message_;                 ///< kept to reuse the memory of its data
  Bytes buffer_;
  std::uint8_t host_ = protocols::apt::address::host;
  std::uint8_t unit_ = protocols::apt::address::usb_unit;  ///< sender of unsolicited messages
  std::uint8_t self_ = protocols::apt::address::usb_unit;  ///< sender of the current answer
  bool enabled_ = true;
  bool homed_ = false;
  bool end_messages_ = true;
  double zero_ = 0;  ///< stage position at which the counter is zero [m] or [rad]
  std::int32_t encoder_zero_counts_ = 0;  ///< steppers: offset set by SET_ENCCOUNTER
  Motion motion_ = Motion::none;
  bool runs_to_low_end_ = false;  ///< a velocity move or endless jog backwards, or a move beyond
  bool on_low_end_ = false;       ///< such a motion has ended at the switch
  std::optional<TimePoint> next_update_;
  std::uint32_t unacknowledged_ = 0;
  std::uint8_t trigger_mode_ = 0;
  std::uint8_t outputs_ = 0;       ///< digital, of the channel
  std::uint8_t rack_outputs_ = 0;  ///< digital, of its rack
  std::uint64_t ignored_ = 0;

  // Effects of faults.
  struct LateEnd {
    TimePoint due;
    MessageId id;
  };
  std::optional<LateEnd> late_end_;
  std::optional<std::int32_t> frozen_counter_;
  bool held_ = false;  ///< the motor is at rest while the controller continues the motion
  bool hung_ = false;  ///< a homing that will not report its end
  double goal_ = 0;    ///< target of the current motion
  MotionLimits goal_limits_{};
  double lost_ = 0;           ///< ways that the counter counted and the motor did not move
  double lossy_from_ = 0;     ///< motor position when the present motion was planned
  double steps_per_way_ = 1;  ///< above 1 while steps are lost
};

}  // namespace weft::sim
