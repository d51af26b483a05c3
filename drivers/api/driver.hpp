#pragma once
// The driver interface. A driver owns no thread, socket or clock: its host gives it a Loop and a
// Link. Built-in drivers throw nothing; what the code of a plugin throws ends at its border.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "drivers/api/sample.hpp"
#include "drivers/api/timer.hpp"
#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"

namespace weft {

/// Moves bytes and stamps their arrival; knows nothing about frames.
/// Serial links deliver any chunking of the stream; datagram links deliver one datagram a call.
class Link {
 public:
  using Receiver = std::function<void(ByteView bytes, TimePoint arrival)>;
  using Closed = std::function<void(const Error& why)>;

  virtual ~Link() = default;
  virtual Status write(ByteView bytes) = 0;
  /// Replaces the receiver; an empty function stops delivery.
  virtual void on_receive(Receiver receiver) = 0;
  /// Called at most once, when the far end goes away.
  virtual void on_closed(Closed closed) = 0;
};

enum class LogLevel { debug, info, warning, error };

/// Closed, open, armed, faulted: see driver_base.hpp for the table.
enum class DriverState { closed, open, armed, faulted };

/// Find the reference mark. Stages only.
struct HomeCommand {};
/// Go to `target` and stop there. [m, m/s] for linear axes, [rad, rad/s] for rotary ones.
struct MoveCommand {
  double target = 0;
  double speed = 0;
  /// Also where the stage has not been homed: positions then count from where it was switched on,
  /// and no travel bounds the target. A plugin gets the move without this, and refuses it.
  bool unhomed = false;
};
/// Move with `velocity` for at most `horizon` and then stop by itself: the finite form of a
/// velocity command, so that a dead host leaves stages that stop. Sent again each cycle by the
/// force loop. Velocity 0 stops along the acceleration ramp, whatever the horizon.
struct ServoCommand {
  double velocity = 0;  ///< [m/s] or [rad/s], signed
  Duration horizon{};
};
/// Ask for one status reading now. Stages only.
struct PollCommand {};
/// Take the present reading as zero. Force/torque sensors only.
struct BiasCommand {};

using Command = std::variant<HomeCommand, MoveCommand, ServoCommand, PollCommand, BiasCommand>;

/// Who a device is: the provenance of its samples.
struct DeviceIdentity {
  /// What came over the wire and nothing else: {"serial", "45000001"}. Empty where the protocol
  /// carries no identity.
  std::vector<std::pair<std::string, std::string>> reported;
  /// What the driver turns counts into SI with: {"counts_per_m", 409.6e6}. Empty for raw counts.
  std::vector<std::pair<std::string, double>> scale;
};
/// {"reported": {...}, "scale": {...}}
std::string to_json(const DeviceIdentity& identity);

/// What a driver gets from the program that runs it. Outlives the driver.
class DriverHost {
 public:
  virtual ~DriverHost() = default;
  virtual Loop& loop() = 0;
  virtual Link& link() = 0;
  /// The device's HTTP port, where the rig file gives one (`http`); nullptr otherwise. Each write()
  /// is a request on a connection of its own: a box may close it after a reply.
  virtual Link* http() { return nullptr; }
  virtual void publish(const Sample& sample) = 0;
  /// Once per conversation, before `open` is told.
  virtual void identified(const DeviceIdentity& identity) = 0;
  virtual void state_changed(DriverState state) = 0;
  /// The driver has left `armed` or `open` for `faulted`.
  virtual void fault(const Error& error) = 0;
  virtual void log(LogLevel level, std::string_view text) = 0;
};

/// One device. open() and arm() return at once; the outcome comes as state_changed() or fault().
class Driver {
 public:
  virtual ~Driver() = default;
  [[nodiscard]] virtual DriverState state() const noexcept = 0;
  /// Starts the conversation: identity is read, checked and told. closed -> open.
  virtual Status open() = 0;
  /// Makes the device ready: channel enabled, limits set, streams started. open -> armed.
  virtual Status arm() = 0;
  /// Armed only. A motion command replaces the one under way. For moves the number to look for in
  /// StageSample::move_id is returned; for other commands 0.
  virtual Result<std::uint32_t> command(const Command& command) = 0;
  /// Ends motion and streams now, in any state.
  virtual void stop() = 0;
  /// Leaves the device quiet. Any state -> closed.
  virtual void close() = 0;
};

/// A driver as the program that holds it knows it. As a shared object the same driver stands behind
/// the C table of weft_driver.h, which plugin.hpp makes from this.
struct DriverEntry {
  const char* name;                ///< "thorlabs_apt"
  const char* summary;             ///< one sentence
  const char* config_schema_json;  ///< JSON Schema of the configuration
  /// `config_json` has been read from the rig file. The error is a sentence for the user.
  Result<std::unique_ptr<Driver>> (*create)(std::string_view config_json, DriverHost& host);
};

}  // namespace weft
