#pragma once
// A process of its own that watches the control loop and stops the stages when it is gone or hangs
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

/// What to send, and where, to stop a device without knowing anything else about it.
struct EmergencyStop {
  LinkSettings link;
  Bytes message;
  /// Of a TCP port: each sockaddr that its host's name has, found before anything can hang.
  std::vector<Bytes> addresses = {};
  /// The stage that carries the probe: the messages that move it to a position, whose last four
  /// bytes are that position [counts, little-endian]. Others: empty.
  Bytes lift = {};
  double counts_per_m = 0;
  double lift_speed_mps = 0;
  Duration braking{};  ///< from its highest speed to rest
};

/// How the stage that carries the probe is to move [m from home].
struct Lift {
  double from_m = 0;  ///< where it stands, about
  double to_m = 0;
};

/// For every device of the rig file that can be stopped by one message to a serial line or a TCP
/// port: the stages. Others are left out; their motions are finite anyhow. Looks host names up,
/// which may take a while. `lift_speed_mps`: of the stage with role z; 0: none is lifted.
std::vector<EmergencyStop> emergency_stops(const RigFile& rig, double lift_speed_mps);

/// Thread-bound. While watched, the loop owes a beat within `max_wait`. If none comes the monitor
/// kills this process. Then, as when this process died by itself, it sends every stop, lifts the
/// probe where lift_to() allows it, and reports what happened and what to do: to standard error,
/// the system log and `log`.
class Monitor {
 public:
  static constexpr Duration default_timeout = std::chrono::seconds(2);

  struct Settings {
    std::vector<EmergencyStop> stops = {};
    /// Device locks that the monitor keeps until the stages are at rest.
    std::vector<int> locks = {};
    /// A line is appended to this file when the host is lost; empty: to none.
    std::filesystem::path log = {};
    Duration max_wait = default_timeout;
  };

  /// Forks: call it before the bench has ports or a real-time priority. Threads of a daemon may be
  /// there: the monitor keeps none of their other descriptors and waits for none of their locks.
  /// Errors: io.
  static Result<std::unique_ptr<Monitor>> start(Settings settings);
  /// Sends the monitor away; nothing is stopped.
  ~Monitor();
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

  /// From now on beats are owed, or no more.
  void watch(bool on);
  void beat();
  /// Where the stage that carries the probe goes when the host is lost; nothing: it only stops, as
  /// before homing and after a halt.
  void plan_lift(std::optional<Lift> lift);
  /// False once the monitor's process has ended, or has not run for two seconds in which this was
  /// called: the run is not watched then.
  [[nodiscard]] bool is_alive();
  [[nodiscard]] pid_t process() const { return process_; }

 private:
  struct Shared;
  Monitor(Shared* shared, pid_t process, int line)
      : shared_(shared), process_(process), line_(line) {}

  Shared* shared_;  ///< memory that both processes see
  pid_t process_;
  bool ended_ = false;        ///< the monitor's process was seen to have ended
  std::uint64_t rounds_ = 0;  ///< of the monitor's loop, as seen last
  std::chrono::nanoseconds seen_at_{}, checked_at_{};  ///< when they went up; when one looked last
  int line_;                                           ///< a socket that closes with this process
};

}  // namespace weft::daemon
