#include "daemon/campaign/monitor.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <system_error>

#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/hardware/link/serial_line.hpp"
#include "protocols/apt/bodies.hpp"

namespace weft::daemon {

struct Monitor::Shared {
  std::atomic<std::uint64_t> beats{0};
  std::atomic<bool> watched{false};
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

namespace {

using namespace protocols::apt;

constexpr int poll_ms = 50;
// A monitor that was itself kept waiting for so long has seen nothing, and starts again.
constexpr std::chrono::milliseconds own_stall{200};
// Over the control loop's 10: a loop that spins must not keep it from running.
constexpr int priority = 20;
constexpr char goodbye = 'q';

/// A channel's profiled stop (APT16 p. 56): the stage keeps its position afterwards.
Bytes apt_stop(const std::string& config_json) {
  const auto config = nlohmann::json::parse(config_json, nullptr, false);
  const auto number = [&](const char* key, int otherwise) {
    return config.is_object() && config.contains(key) && config[key].is_number_integer()
               ? config[key].get<int>()
               : otherwise;
  };
  const Route route{static_cast<std::uint8_t>(number("destination", address::usb_unit)),
                    address::host};
  Bytes message;
  append_short(message, MessageId::move_stop, static_cast<std::uint8_t>(number("channel", 1)),
               static_cast<std::uint8_t>(StopMode::profiled), route);
  return message;
}

int open_line(const SerialSettings& line) {
  const int port = ::open(line.path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (port < 0) return port;
  // The line is as the dead host left it; where that fails, its settings are tried all the same.
  if (set_line_raw(port, false)) static_cast<void>(set_line_speed(port, line.baud));
  return port;
}

/// Where a TCP port may be, as connect() takes it; empty for another link, or when nobody knows the
/// host: then the bench does not get its port either.
std::vector<Bytes> addresses_of(const LinkSettings& link) {
  const auto* tcp = std::get_if<TcpPort>(&link);
  if (tcp == nullptr) return {};
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const std::string port = std::to_string(tcp->end.port);
  if (::getaddrinfo(tcp->end.host.c_str(), port.c_str(), &wanted, &found) != 0) return {};
  std::vector<Bytes> addresses;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(one->ai_addr);
    addresses.emplace_back(bytes, bytes + one->ai_addrlen);
  }
  ::freeaddrinfo(found);
  return addresses;
}

int open_socket(const Bytes& bytes) {
  sockaddr_storage address{};
  std::memcpy(&address, bytes.data(), bytes.size());
  const int socket = ::socket(address.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const timeval limit{1, 0};
  ::setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  if (::connect(socket, reinterpret_cast<const sockaddr*>(&address),
                static_cast<socklen_t>(bytes.size())) == 0)
    return socket;
  ::close(socket);
  return -1;
}

/// The first of the addresses where somebody listens.
int open_socket(const std::vector<Bytes>& addresses) {
  for (const Bytes& address : addresses)
    if (const int socket = open_socket(address); socket >= 0) return socket;
  return -1;
}

void send(const EmergencyStop& stop) {
  const auto* line = std::get_if<SerialSettings>(&stop.link);
  const int port = line != nullptr ? open_line(*line) : open_socket(stop.addresses);
  if (port < 0) return;
  const ssize_t sent = ::write(port, stop.message.data(), stop.message.size());
  if (sent > 0 && line != nullptr) ::tcdrain(port);
  ::close(port);
}

enum class HostSignal { nothing, farewell, end };

/// Waits a little for the host's end of the pipe.
HostSignal poll_host(int line, int wait_ms) {
  pollfd end{line, POLLIN, 0};
  if (::poll(&end, 1, wait_ms) <= 0) return HostSignal::nothing;
  char byte = 0;
  return ::read(line, &byte, 1) == 1 && byte == goodbye ? HostSignal::farewell : HostSignal::end;
}

/// Keeps standard input, output and error and this end of the pipe, and returns it. Whatever else
/// the host had open stays the host's alone: a lock of a folder is let go and a client's connection
/// ends when the host closes it, not when the monitor goes.
int close_all_except(int line) {
  constexpr int log_fd = STDERR_FILENO + 1;
  if (line != log_fd) ::dup2(line, log_fd);
  ::close_range(log_fd + 1, ~0U, 0);
  return log_fd;
}

void become_monitor() {
  ::setsid();  // Ctrl-C is for the host, which then ends tidily
  for (const int number : {SIGINT, SIGHUP, SIGPIPE, SIGTERM}) ::signal(number, SIG_IGN);
  sched_param parameters{};
  parameters.sched_priority = priority;
  ::sched_setscheduler(0, SCHED_FIFO, &parameters);  // refused: it watches less punctually
}

enum class HostEnd { farewell, died, killed };

/// The monitor's life. `died` only where it was watched.
template <class Shared>
HostEnd watch_host(const Shared& shared, int line, pid_t host, Duration max_wait) {
  std::uint64_t beats = 0;
  auto beaten = steady_wall_now();
  for (auto last = beaten;;) {
    const HostSignal seen = poll_host(line, poll_ms);
    if (seen != HostSignal::nothing)
      return seen == HostSignal::end && shared.watched ? HostEnd::died : HostEnd::farewell;
    const auto now = steady_wall_now();
    const bool was_suspended = now - last > own_stall;
    last = now;
    const std::uint64_t present = shared.beats;
    if (was_suspended || present != std::exchange(beats, present) || !shared.watched) beaten = now;
    if (now - beaten < max_wait) continue;
    ::kill(host, SIGKILL);
    while (poll_host(line, poll_ms) == HostSignal::nothing) {
    }
    return HostEnd::killed;
  }
}

/// What standard error is told of a host that is lost. Made before the fork: a child of a
/// process with threads may not allocate.
struct Notices {
  std::string died, killed;
};

Notices format_notices(pid_t host, std::size_t stops, Duration max_wait) {
  using seconds = std::chrono::duration<double>;
  std::ostringstream limit;
  limit << std::chrono::duration_cast<seconds>(max_wait).count();
  // systemd's journal takes the priority; elsewhere it would be in the way.
  const char* const log_level = std::getenv("JOURNAL_STREAM") != nullptr ? "<3>" : "";
  const std::string begin =
      std::string(log_level) + "weft monitor: process " + std::to_string(host);
  const std::string end = "; stop sent to " + std::to_string(stops) +
                          " stages; the rig is as the run left it: inspect it, start again, then "
                          "see weft status\n";
  return {begin + " ended while a run had the rig" + end,
          begin + " killed: its control loop gave no sign of life for " + limit.str() +
              " s (hung, stopped or starved of the processor)" + end};
}

/// After the stops, which wait for nothing. A reader that keeps its writer waiting gets none.
void write_notice(const std::string& text) {
  pollfd out{STDERR_FILENO, POLLOUT, 0};
  if (::poll(&out, 1, 0) > 0) static_cast<void>(!::write(STDERR_FILENO, text.data(), text.size()));
}

}  // namespace

std::vector<EmergencyStop> emergency_stops(const RigFile& rig) {
  std::vector<EmergencyStop> stops;
  for (const DeviceEntry& device : rig.devices)
    if (device.driver == "thorlabs_apt")
      stops.push_back({device.link, apt_stop(device.config_json), addresses_of(device.link)});
  return stops;
}

Result<std::unique_ptr<Monitor>> Monitor::start(std::vector<EmergencyStop> stops,
                                                Duration max_wait) {
  const auto failed = [](const char* what) {
    return fail({.code = Errc::io,
                 .where = "monitor",
                 .what = what,
                 .got = std::generic_category().message(errno)});
  };
  void* memory =
      ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return failed("no memory to share with the monitor");
  auto* shared = new (memory) Shared;
  std::array<int, 2> line{};
  if (::pipe2(line.data(), O_CLOEXEC) != 0) return failed("no pipe to the monitor");
  const pid_t host = ::getpid();
  const Notices notices = format_notices(host, stops.size(), max_wait);
  const pid_t child = ::fork();
  if (child < 0) return failed("the monitor could not be started");
  if (child == 0) {
    ::close(line[1]);  // or its end would never be heard
    const int host_line = close_all_except(line[0]);
    become_monitor();
    const HostEnd end = watch_host(*shared, host_line, host, max_wait);
    if (end == HostEnd::farewell) ::_exit(0);
    for (const EmergencyStop& stop : stops) send(stop);
    write_notice(end == HostEnd::killed ? notices.killed : notices.died);
    ::_exit(0);
  }
  ::close(line[0]);
  return std::unique_ptr<Monitor>(new Monitor(shared, child, line[1]));
}

Monitor::~Monitor() {
  watch(false);
  while (::write(line_, &goodbye, 1) < 0 && errno == EINTR) {
  }
  ::close(line_);
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
  }
  ::munmap(shared_, sizeof(Shared));
}

void Monitor::watch(bool on) {
  shared_->beats.fetch_add(1);
  shared_->watched = on;
}

void Monitor::beat() {
  shared_->beats.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace weft::daemon
