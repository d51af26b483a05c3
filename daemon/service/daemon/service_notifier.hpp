#pragma once
// Messages to the service manager that started the daemon: ready, alive, reloading, stopping. A
// datagram of lines to NOTIFY_SOCKET. Source: sd_notify(3), systemd.service(5).

#include <sys/socket.h>
#include <sys/un.h>

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace weft::daemon::server {

/// Does nothing where no service manager waits (NOTIFY_SOCKET is not set). Used by one thread.
class ServiceNotifier {
 public:
  using Clock = std::chrono::nanoseconds;  ///< CLOCK_MONOTONIC, as MONOTONIC_USEC is

  /// By NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID.
  ServiceNotifier();
  ~ServiceNotifier();
  ServiceNotifier(const ServiceNotifier&) = delete;
  ServiceNotifier& operator=(const ServiceNotifier&) = delete;

  /// Also once a reload is done.
  void ready();
  void reloading(Clock now);
  /// Call often while the daemon's loop runs: WATCHDOG=1 twice in the time that the manager waits
  /// for it, and each second STATUS, where it is another.
  void tick(Clock now, const std::function<std::string()>& status);
  /// Call often while the daemon ends: STOPPING=1, and each second how long it may still take.
  void stopping(Clock now, Clock deadline);

 private:
  enum class Wait { as_needed, not_at_all };
  void send(const std::string& lines, Wait wait = Wait::not_at_all) const;

  int socket_ = -1;  ///< -1: nobody waits
  sockaddr_un address_{};
  socklen_t address_bytes_ = 0;
  Clock watchdog_{};  ///< 0: not wanted
  std::optional<Clock> beaten_, status_at_, extended_;
  std::string status_;
};

}  // namespace weft::daemon::server
