#include "daemon/service/daemon/service_notifier.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <utility>

namespace weft::daemon::server {
namespace {

using namespace std::chrono_literals;

std::string_view variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? std::string_view() : value;
}

/// 0 if it is not a number.
std::int64_t number_in(const char* name) {
  const std::string_view text = variable(name);
  std::int64_t value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  return read.ec == std::errc() && read.ptr == text.data() + text.size() ? value : 0;
}

std::string usec(std::chrono::nanoseconds time) {
  return std::to_string(std::chrono::duration_cast<std::chrono::microseconds>(time).count());
}

/// True if `since` is at least `period` ago or unset; then sets it to `now`.
bool is_due(std::optional<std::chrono::nanoseconds>& since, std::chrono::nanoseconds now,
            std::chrono::nanoseconds period) {
  if (since && now - *since < period) return false;
  since = now;
  return true;
}

}  // namespace

ServiceNotifier::ServiceNotifier() {
  const std::string_view path = variable("NOTIFY_SOCKET");
  if (path.size() < 2 || path.size() >= sizeof address_.sun_path) return;
  if (path.front() != '/' && path.front() != '@') return;
  address_.sun_family = AF_UNIX;
  std::ranges::copy(path, address_.sun_path);
  if (path.front() == '@') address_.sun_path[0] = '\0';  // an abstract name, not a file
  address_bytes_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
  socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const std::int64_t process = number_in("WATCHDOG_PID");
  if (process == 0 || process == getpid())
    watchdog_ = std::chrono::microseconds(number_in("WATCHDOG_USEC"));
}

ServiceNotifier::~ServiceNotifier() {
  if (socket_ >= 0) ::close(socket_);
}

// A repeated message does not wait for the manager to read it; a message sent once does.
void ServiceNotifier::send(const std::string& lines, Wait wait) const {
  if (socket_ < 0) return;
  const int flags = MSG_NOSIGNAL | (wait == Wait::not_at_all ? MSG_DONTWAIT : 0);
  const auto* const to = reinterpret_cast<const sockaddr*>(&address_);
  while (::sendto(socket_, lines.data(), lines.size(), flags, to, address_bytes_) < 0 &&
         errno == EINTR) {
  }
}

void ServiceNotifier::ready() {
  send("READY=1\n", Wait::as_needed);
}

void ServiceNotifier::reloading(Clock now) {
  send("RELOADING=1\nMONOTONIC_USEC=" + usec(now) + "\n", Wait::as_needed);
}

void ServiceNotifier::tick(Clock now, const std::function<std::string()>& status) {
  if (socket_ < 0) return;
  if (watchdog_ > 0ns && is_due(beaten_, now, watchdog_ / 2)) send("WATCHDOG=1\n");
  if (!is_due(status_at_, now, 1s)) return;
  std::string text = status();
  std::ranges::replace(text, '\n', ' ');
  if (text == status_) return;
  status_ = std::move(text);
  send("STATUS=" + status_ + "\n");
}

// The extension counts from the time of its message; timely messages extend the stop again and
// again. After the deadline the ladder (halt, give up) takes another 10 s.
void ServiceNotifier::stopping(Clock now, Clock deadline) {
  constexpr Clock after_deadline = 15s;
  if (!is_due(extended_, now, 1s)) return;
  const Clock left = deadline == Clock::max() ? Clock(0) : std::max(deadline - now, Clock(0));
  send("STOPPING=1\nEXTEND_TIMEOUT_USEC=" + usec(left + after_deadline) + "\n");
}

}  // namespace weft::daemon::server
