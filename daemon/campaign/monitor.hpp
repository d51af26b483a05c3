#pragma once
// A process of its own that watches the control loop and stops the stages when it is gone or hangs
// (docs/adr/0008-a-monitor-of-its-own.md).

#include <sys/types.h>

#include <memory>
#include <vector>

#include "daemon/hardware/rig/rig_file.hpp"
#include "protocols/base/bytes.hpp"
#include "protocols/base/time.hpp"

namespace weft::daemon {

/// What to say, and where, to stop a device without knowing anything else about it.
struct EmergencyStop {
  LinkSettings link;
  Bytes message;
  /// Of a TCP port: each sockaddr that its host's name has, found before anything can hang.
  std::vector<Bytes> addresses = {};
};

/// For every device of the rig file that can be stopped by one message to a serial line or a TCP
/// port: the stages. Others are left out; their motions are finite anyhow. Looks host names up,
/// which may take a while.
std::vector<EmergencyStop> emergency_stops(const RigFile& rig);

/// Thread-bound. While watched, the loop owes a beat within `max_wait`. If none comes the monitor
/// kills this process, and then, as when this process died by itself, sends every stop and writes
/// to standard error what happened and what to do.
class Monitor {
 public:
  static constexpr Duration default_timeout = std::chrono::seconds(2);

  /// Forks: call it before the bench has ports or a real-time priority. Threads of a daemon may be
  /// there: the monitor keeps none of their descriptors and waits for none of their locks.
  /// Errors: io.
  static Result<std::unique_ptr<Monitor>> start(std::vector<EmergencyStop> stops,
                                                Duration max_wait = default_timeout);
  /// Sends the monitor away; nothing is stopped.
  ~Monitor();
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

  /// From now on beats are owed, or no more.
  void watch(bool on);
  void beat();
  [[nodiscard]] pid_t process() const { return process_; }

 private:
  struct Shared;
  Monitor(Shared* shared, pid_t process, int line)
      : shared_(shared), process_(process), line_(line) {}

  Shared* shared_;  ///< memory that both processes see
  pid_t process_;
  int line_;  ///< a pipe that closes with this process
};

}  // namespace weft::daemon
