#pragma once
// Reports to the service manager that started the daemon: ready, alive, reloading, stopping. Sends
// each report as a datagram to NOTIFY_SOCKET. Source: sd_notify(3), systemd.service(5).

#include <sys/socket.h>
#include <sys/un.h>

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace weft::daemon::server {

/// Does nothing without a service manager (NOTIFY_SOCKET is not set). Thread: one.
class ServiceNotifier {
 public:
  using Clock = std::chrono::nanoseconds;  ///< CLOCK_MONOTONIC, like MONOTONIC_USEC

  /// Reads NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID.
  ServiceNotifier();
  ~ServiceNotifier();
  ServiceNotifier(const ServiceNotifier&) = delete;
  ServiceNotifier& operator=(const ServiceNotifier&) = delete;

  /// Also reports the end of a reload.
  void ready();
  void reloading(Clock now);
  /// Call often while the daemon's loop runs. Sends WATCHDOG=1 twice per watchdog interval, and
  /// STATUS at most once a second when it changed.
  void tick(Clock now, const std::function<std::string()>& status);
  /// Call often while the daemon ends. Sends STOPPING=1 and, every second, how long it may still
  /// take.
  void stopping(Clock now, Clock deadline);

 private:
  enum class Wait { as_needed, not_at_all };
  void send(const std::string& lines, Wait wait = Wait::not_at_all) const;

  int socket_ = -1;  ///< -1: no service manager
  sockaddr_un address_{};
  socklen_t address_bytes_ = 0;
  Clock watchdog_{};  ///< 0: no watchdog
  std::optional<Clock> beaten_, status_at_, extended_;
  std::string status_;
};

}  // namespace weft::daemon::server
