#pragma once
// The driver interface. A driver owns no thread, socket or clock: its host provides a Loop and a
// Link. Built-in drivers do not throw. The host contains exceptions of a plugin's code.

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

/// Moves bytes and stamps their arrival; does not know frames. Serial links deliver any chunking of
/// the stream; datagram links deliver one datagram per call.
class Link {
 public:
  using Receiver = std::function<void(ByteView bytes, TimePoint arrival)>;
  using Closed = std::function<void(const Error& why)>;

  virtual ~Link() = default;
  virtual Status write(ByteView bytes) = 0;
  /// Replaces the receiver; an empty function stops delivery.
  virtual void on_receive(Receiver receiver) = 0;
  /// Called at most once, when the remote end closes.
  virtual void on_closed(Closed closed) = 0;
};

enum class LogLevel { debug, info, warning, error };

/// The transitions are in lifecycle_table (driver_base.hpp).
enum class DriverState { closed, open, armed, faulted };

/// Homes the stage: finds its reference switch. Stages only.
struct HomeCommand {};
/// Moves to `target` and stops there. [m, m/s] for linear axes, [rad, rad/s] for rotary ones.
struct MoveCommand {
  double target = 0;
  double speed = 0;
  /// Allows the move before homing: positions then count from the power-on position, and no travel
  /// limit checks the target. The plugin ABI does not carry this flag, so a plugin refuses the
  /// move.
  bool unhomed = false;
};
/// Moves with `velocity` for at most `horizon`, then the stage stops by itself. This finite form of
/// a velocity command stops the stages if the host dies. The force loop repeats it each cycle.
/// Velocity 0 stops along the acceleration ramp, independent of the horizon.
struct ServoCommand {
  double velocity = 0;  ///< [m/s] or [rad/s], signed
  Duration horizon{};
};
/// Requests one status reading now. Stages only.
struct PollCommand {};
/// Takes the present reading as the bias. Force/torque sensors only.
struct BiasCommand {};

using Command = std::variant<HomeCommand, MoveCommand, ServoCommand, PollCommand, BiasCommand>;

/// Identity of a device: the provenance of its samples.
struct DeviceIdentity {
  /// Only values received from the device: {"serial", "45000001"}. Empty if the protocol carries no
  /// identity.
  std::vector<std::pair<std::string, std::string>> reported;
  /// The driver's factors from counts to SI: {"counts_per_m", 409.6e6}. Empty for raw counts.
  std::vector<std::pair<std::string, double>> scale;
};
/// {"reported": {...}, "scale": {...}}
std::string to_json(const DeviceIdentity& identity);

/// Interface of the program that runs a driver. Outlives the driver. Thread: the loop's.
class DriverHost {
 public:
  virtual ~DriverHost() = default;
  virtual Loop& loop() = 0;
  virtual Link& link() = 0;
  /// The device's HTTP port (rig key `http`); nullptr if the rig file has none. Each write() is a
  /// request on its own connection: a box may close it after a reply.
  virtual Link* http() { return nullptr; }
  virtual void publish(const Sample& sample) = 0;
  /// Called once per open(), before state_changed(open).
  virtual void identified(const DeviceIdentity& identity) = 0;
  virtual void state_changed(DriverState state) = 0;
  /// The driver has left `armed` or `open` for `faulted`.
  virtual void fault(const Error& error) = 0;
  virtual void log(LogLevel level, std::string_view text) = 0;
};

/// One device. open() and arm() return at once; the outcome arrives as state_changed() or fault().
class Driver {
 public:
  virtual ~Driver() = default;
  [[nodiscard]] virtual DriverState state() const noexcept = 0;
  /// Starts communication: reads, checks and reports the identity. closed -> open.
  virtual Status open() = 0;
  /// Makes the device ready: channel enabled, limits set, streams started. open -> armed.
  virtual Status arm() = 0;
  /// Armed only. A motion command replaces the current one. Returns the number that
  /// StageSample::move_id will show for a move, and 0 for other commands.
  virtual Result<std::uint32_t> command(const Command& command) = 0;
  /// Ends motion and streams at once, in any state.
  virtual void stop() = 0;
  /// Leaves the device idle. Any state -> closed.
  virtual void close() = 0;
};

/// A driver as registered in a program. In a plugin, plugin.hpp makes the C table of weft_driver.h
/// from it.
struct DriverEntry {
  const char* name;                ///< "thorlabs_apt"
  const char* summary;             ///< one sentence
  const char* config_schema_json;  ///< JSON Schema of the configuration
  /// `config_json` comes from the rig file. The error is a sentence for the user.
  Result<std::unique_ptr<Driver>> (*create)(std::string_view config_json, DriverHost& host);
};

}  // namespace weft
