#pragma once
// A separate process that watches the control loop and stops the stages when the loop ends or hangs
// (docs/adr/0008-a-monitor-of-its-own.md).

#include <sys/types.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "daemon/hardware/rig/rig_file.hpp"
#include "protocols/base/bytes.hpp"
#include "protocols/base/time.hpp"

namespace weft::daemon {

/// Message and address that stop a device, without other knowledge of it.
struct EmergencyStop {
  LinkSettings link;
  Bytes message;
  /// For a TCP port: each sockaddr of its host name, looked up before anything can hang.
  std::vector<Bytes> addresses = {};
  /// For the stage that carries the probe: the messages that move it to a position. Their last four
  /// bytes are that position [counts, little-endian]. Empty for others.
  Bytes lift = {};
  double counts_per_m = 0;
  double lift_speed_mps = 0;
  Duration braking{};  ///< from its highest speed to rest
};

/// Motion of the stage that carries the probe [m from home].
struct Lift {
  double from_m = 0;  ///< present position, approximate
  double to_m = 0;
};

/// Stops for every device that one message to a serial or TCP port can stop: the stages. Other
/// devices are left out; their motions are finite. Looks host names up, which may take a while.
/// `lift_speed_mps`: of the stage with role z; 0: no lift.
std::vector<EmergencyStop> emergency_stops(const RigFile& rig, double lift_speed_mps);

/// Thread-bound. While watched, the loop must beat within `max_wait`; otherwise the monitor kills
/// this process. When this process has ended, the monitor sends every stop and lifts the probe if
/// plan_lift() allows it. Then it reports the event and what to do, to standard error, the system
/// log and `log`.
class Monitor {
 public:
  static constexpr Duration default_timeout = std::chrono::seconds(2);

  struct Settings {
    std::vector<EmergencyStop> stops = {};
    /// Device locks that the monitor keeps until the stages are at rest.
    std::vector<int> locks = {};
    /// A line is appended to this file when the host is lost; empty: no file.
    std::filesystem::path log = {};
    Duration max_wait = default_timeout;
  };

  /// Forks: call it before the bench has ports or a real-time priority. A daemon's threads may
  /// exist: the monitor keeps none of their other descriptors and waits for none of their locks.
  /// Errors: io.
  static Result<std::unique_ptr<Monitor>> start(Settings settings);
  /// Ends the monitor; stops nothing.
  ~Monitor();
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

  /// Starts or ends the requirement of beats.
  void watch(bool on);
  void beat();
  /// Target of the stage that carries the probe if the host is lost. Nothing: it only stops, as
  /// before homing and after a halt.
  void plan_lift(std::optional<Lift> lift);
  /// False if the monitor's process has ended, or has not run for two seconds of regular calls:
  /// then the run is not watched.
  [[nodiscard]] bool is_alive();
  [[nodiscard]] pid_t process() const { return process_; }

 private:
  struct Shared;
  Monitor(Shared* shared, pid_t process, int line)
      : shared_(shared), process_(process), line_(line) {}

  Shared* shared_;  ///< memory shared by both processes
  pid_t process_;
  bool ended_ = false;        ///< the monitor's process has ended
  std::uint64_t rounds_ = 0;  ///< of the monitor's loop, at the last call
  /// Time of the last change of `rounds_`; time of the last call.
  std::chrono::nanoseconds seen_at_{}, checked_at_{};
  int line_;  ///< socket that closes with this process
};

}  // namespace weft::daemon
