#pragma once
// A Thorlabs stage behind its APT controller: stepper family (LTS150, status 0x0481) and DC servo
// family (PRM1-Z8 on KDC101, status 0x0491). Reference protocols.md part A.

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "protocols/apt/apt.hpp"
#include "sim/devices/bench_world.hpp"
#include "sim/devices/emulator.hpp"

namespace weft::sim {

/// What a move command does to the move under way: not specified in APT16, so it can be chosen.
enum class RetargetPolicy : std::uint8_t {
  replan,  ///< go to the new target at once, from the present velocity
  ignore,  ///< finish what was begun
};

struct AptStageParams {
  AxisId axis = AxisId::x;
  const protocols::apt::StageModel* stage = nullptr;  ///< scale, limits and defaults
  std::string model = "LTS150";                       ///< of the controller, at most 8 characters
  std::int32_t serial = 45000001;
  std::uint8_t address = protocols::apt::address::usb_unit;
  RetargetPolicy retarget = RetargetPolicy::replan;
  /// Servo controllers fall silent after this many status messages without an acknowledgement
  /// (APT16 p. 98); 0 switches it off.
  std::uint32_t silent_after = 50;
};

class AptStageEmulator final : public Emulator {
 public:
  /// Powered on: not homed, disabled, counter at zero wherever the carriage is. `world` outlives
  /// it.
  AptStageEmulator(const AptStageParams& params, BenchWorld& world, TimePoint now);

  void receive(ByteView bytes, TimePoint now, ByteSink& out) override;
  [[nodiscard]] std::optional<TimePoint> next_wakeup() const override;
  void wake(TimePoint now, ByteSink& out) override;

  /// Messages that were not for this unit, unknown to it, or with a body of the wrong length.
  [[nodiscard]] std::uint64_t ignored() const { return ignored_; }

 private:
  using Message = protocols::apt::Message;
  using MessageId = protocols::apt::MessageId;
  enum class Motion : std::uint8_t { none, home, move, stopping };

  void handle(const Message& message, TimePoint now, ByteSink& out);
  bool handle_system(const Message& message, TimePoint now, ByteSink& out);
  bool handle_motion(const Message& message, TimePoint now, ByteSink& out);
  bool handle_status(const Message& message, TimePoint now, ByteSink& out);
  bool handle_parameters(const Message& message, TimePoint now, ByteSink& out);
  void set_parameters(const Message& message, TimePoint now);
  void set_default_parameters();

  void home(TimePoint now);
  bool move(const Message& message, bool relative, TimePoint now);
  void jog(const Message& message, TimePoint now);
  void move_to(double target, TimePoint now);
  void run_towards_limit(std::uint8_t direction, TimePoint now);
  void stop(const Message& message, TimePoint now);
  void finish_motion(TimePoint at, ByteSink& out);

  [[nodiscard]] MotionLimits limits() const;
  [[nodiscard]] MotionLimits home_limits() const;
  [[nodiscard]] double counter_si(std::int32_t counts) const;  ///< a count as a stage position
  [[nodiscard]] std::int32_t counter(TimePoint now) const;
  [[nodiscard]] std::uint32_t status_bits(TimePoint now) const;
  [[nodiscard]] bool servo() const;
  [[nodiscard]] const Stage& stage() const;

  void reply_short(MessageId id, std::uint8_t param1, std::uint8_t param2, ByteSink& out);
  template <class Body>
  void reply(MessageId id, const Body& body, ByteSink& out);
  void reply_status(MessageId id, TimePoint now, ByteSink& out);
  void reply_info(ByteSink& out);
  void send_update(TimePoint now, ByteSink& out);

  AptStageParams params_;
  BenchWorld* world_;
  protocols::apt::Splitter splitter_;
  Message message_;  ///< kept for the room of its data
  Bytes buffer_;
  std::map<MessageId, Bytes> parameters_;  ///< bodies by the id of their SET message
  std::uint8_t host_ = protocols::apt::address::host;
  bool enabled_ = false;
  bool homed_ = false;
  bool end_messages_ = true;
  double zero_ = 0;  ///< stage position at which the counter is zero [m] or [rad]
  Motion motion_ = Motion::none;
  std::optional<TimePoint> next_update_;
  std::uint32_t unacknowledged_ = 0;
  std::uint64_t ignored_ = 0;
};

}  // namespace weft::sim
