#include "daemon/campaign/monitor.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <sstream>
#include <string>
#include <system_error>

#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/hardware/link/serial_line.hpp"
#include "drivers/thorlabs_apt/settings.hpp"
#include "protocols/apt/bodies.hpp"

namespace weft::daemon {
namespace {

constexpr double no_lift = std::numeric_limits<double>::quiet_NaN();

}  // namespace

struct Monitor::Shared {
  std::atomic<std::uint64_t> beats{0};
  std::atomic<bool> watched{false};
  std::atomic<double> lift_from_m{no_lift}, lift_to_m{no_lift};
  std::atomic<std::uint64_t> rounds{0};  ///< of the monitor's loop
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free &&
              std::atomic<double>::is_always_lock_free);

namespace {

using namespace protocols::apt;

constexpr int poll_ms = 50;
// A monitor that was itself suspended for this long has missed beats and starts again.
constexpr std::chrono::milliseconds own_stall{200};
// Above the control loop's 10: a loop that spins must not keep the monitor from running.
constexpr int priority = 20;
constexpr char goodbye = 'q';
// Delays of links and controllers, in addition to the ramp and to the travel of a lift.
constexpr Duration braking_grace = std::chrono::milliseconds(100);
constexpr Duration lift_grace = std::chrono::seconds(1), longest_lift = std::chrono::seconds(60);

/// A channel's profiled stop (APT16 p. 56): the stage keeps its position afterwards. For z also the
/// move that lifts the probe.
EmergencyStop apt_stop(const DeviceEntry& device, DriverCatalog* drivers, double lift_speed_mps) {
  EmergencyStop stop;
  stop.link = device.link;
  // Includes the rig's acceleration limit, as the driver gets it.
  const Result<std::string> config =
      drivers != nullptr ? driver_config(device, *drivers) : device.config_json;
  if (!config) return stop;  // the bench refuses it too: the run does not start
  const auto settings = drivers::read_stage_settings(*config);
  if (!settings) return stop;
  const Route route{settings->destination, address::host};
  append_short(stop.message, MessageId::move_stop, settings->channel,
               static_cast<std::uint8_t>(StopMode::profiled), route);
  if (device.role != "z" || lift_speed_mps <= 0) return stop;
  const double speed = std::min(lift_speed_mps, settings->max_speed);
  VelocityParams velocity{settings->channel, 0, settings->acceleration_counts, 0};
  stop.lift_speed_mps = speed;
  stop.braking = from_seconds(speed / settings->acceleration);
  velocity.maximum_velocity_counts =
      velocity_to_counts(settings->scale, speed).value_or(settings->default_velocity_counts);
  append_message(stop.lift, MessageId::set_velparams, velocity, route);
  append_message(stop.lift, MessageId::move_absolute, ChannelCounts{settings->channel, 0}, route);
  stop.counts_per_m = settings->scale.counts_per_unit;
  return stop;
}

int open_line(const SerialSettings& line) {
  const int port = ::open(line.path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (port < 0) return port;
  // The port is as the dead host left it. If this call fails, the port's settings are used anyway.
  if (set_line_raw(port, false)) static_cast<void>(set_line_speed(port, line.baud));
  return port;
}

/// Addresses of a TCP port for connect(). Empty for another link or an unknown host: then the bench
/// cannot open its port either.
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

/// Connects to the first address that accepts.
int open_socket(const std::vector<Bytes>& addresses) {
  for (const Bytes& address : addresses)
    if (const int socket = open_socket(address); socket >= 0) return socket;
  return -1;
}

/// True if the whole message was sent.
bool send(const EmergencyStop& stop, const Bytes& message) {
  const auto* line = std::get_if<SerialSettings>(&stop.link);
  const int port = line != nullptr ? open_line(*line) : open_socket(stop.addresses);
  if (port < 0) return false;
  const ssize_t sent = ::write(port, message.data(), message.size());
  if (sent > 0 && line != nullptr) ::tcdrain(port);
  ::close(port);
  return sent == static_cast<ssize_t>(message.size());
}

/// True if the lift was sent. Writes the target position into the messages first: it is known only
/// now.
bool send_lift(EmergencyStop& stop, double z_m) {
  if (stop.lift.empty() || std::isnan(z_m)) return false;
  auto counts =
      static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(z_m * stop.counts_per_m)));
  for (std::size_t i = stop.lift.size() - 4; i < stop.lift.size(); ++i, counts >>= 8)
    stop.lift[i] = static_cast<std::uint8_t>(counts & 0xFF);
  return send(stop, stop.lift);
}

/// Result of stopping the stages.
struct Stopped {
  std::size_t stopped = 0;
  bool lifted = false;
  Duration lift_takes{};
};

void wait(Duration time) {
  ::poll(nullptr, 0,
         static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(time).count()));
}

Stopped stop_stages(std::vector<EmergencyStop>& stops, Lift lift) {
  Stopped done;
  for (const EmergencyStop& stop : stops) done.stopped += send(stop, stop.message) ? 1 : 0;
  if (std::isnan(lift.to_m)) return done;
  for (EmergencyStop& stop : stops) {
    if (stop.lift.empty()) continue;
    wait(stop.braking + braking_grace);
    if (!send_lift(stop, lift.to_m)) continue;
    done.lifted = true;
    done.lift_takes =
        std::min(from_seconds(std::abs(lift.from_m - lift.to_m) / stop.lift_speed_mps) +
                     stop.braking + lift_grace,
                 longest_lift);
  }
  return done;
}

enum class HostSignal { nothing, farewell, end };

/// Waits up to `wait_ms` for the host's end of the socket.
HostSignal poll_host(int line, int wait_ms) {
  pollfd end{line, POLLIN, 0};
  if (::poll(&end, 1, wait_ms) <= 0) return HostSignal::nothing;
  char byte = 0;
  return ::read(line, &byte, 1) == 1 && byte == goodbye ? HostSignal::farewell : HostSignal::end;
}

/// Keeps standard input, output and error, this end of the socket and the device locks. Closes all
/// other descriptors of the host. A folder lock is then released, and a client's connection ends,
/// when the host closes it. `kept`: sorted.
void close_all_except(const std::vector<int>& kept) {
  unsigned next = STDERR_FILENO + 1;
  for (const int fd : kept) {
    const auto number = static_cast<unsigned>(fd);
    if (number > next) ::close_range(next, number - 1, 0);
    next = std::max(next, number + 1);
  }
  ::close_range(next, ~0U, 0);
}

void become_monitor() {
  ::setsid();  // Ctrl-C is for the host, which then ends in order
  for (const int number : {SIGINT, SIGHUP, SIGPIPE, SIGTERM, SIGTSTP, SIGTTIN, SIGTTOU, SIGXFSZ})
    ::signal(number, SIG_IGN);
  sched_param parameters{};
  parameters.sched_priority = priority;
  ::sched_setscheduler(0, SCHED_FIFO, &parameters);  // if refused, the monitor is less punctual
}

enum class HostEnd { farewell, died, killed };

/// Main loop of the monitor. Returns `died` only while the host is watched.
template <class Shared>
HostEnd watch_host(Shared& shared, int line, pid_t host, Duration max_wait) {
  std::uint64_t beats = 0;
  auto beaten = steady_wall_now();
  for (auto last = beaten;;) {
    const HostSignal seen = poll_host(line, poll_ms);
    shared.rounds.fetch_add(1);
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

/// Beginning and end of the notice about a lost host. Made before the fork: a child of a process
/// with threads may not allocate.
struct NoticeText {
  std::string died, killed;
  std::filesystem::path log;
  bool is_journal;  ///< standard error is systemd's journal, which accepts a priority
};

NoticeText format_notices(pid_t host, const Monitor::Settings& settings) {
  using seconds = std::chrono::duration<double>;
  std::ostringstream limit;
  limit << std::chrono::duration_cast<seconds>(settings.max_wait).count();
  const std::string begin = "weft monitor: process " + std::to_string(host);
  return {begin + " ended while a run controlled the rig",
          begin + " killed: its control loop did not respond for " + limit.str() +
              " s (hung, stopped or without processor time)",
          settings.log, std::getenv("JOURNAL_STREAM") != nullptr};
}

using Line = std::array<char, 512>;

/// "2026-11-29 06:33:06 UTC ", by arithmetic only: the C library's calendar functions take a lock.
int print_time(Line& line) {
  using namespace std::chrono;
  const sys_time<nanoseconds> now(utc_now());
  const auto day = floor<days>(now);
  const year_month_day date(day);
  const hh_mm_ss time(floor<seconds>(now - day));
  return std::snprintf(line.data(), line.size(), "%04d-%02u-%02u %02d:%02d:%02d UTC ",
                       static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                       static_cast<unsigned>(date.day()), static_cast<int>(time.hours().count()),
                       static_cast<int>(time.minutes().count()),
                       static_cast<int>(time.seconds().count()));
}

void append_to_log(const std::filesystem::path& log, const Line& text) {
  if (log.empty()) return;
  const int file = ::open(log.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0644);
  if (file < 0) return;
  Line line{};
  const int length = print_time(line);
  std::snprintf(line.data() + length, line.size() - static_cast<std::size_t>(length), "%.440s\n",
                text.data());
  static_cast<void>(!::write(file, line.data(), std::strlen(line.data())));
  ::fsync(file);
  ::close(file);
}

/// Sends the message directly to the socket that syslog(3) uses: syslog(3) takes locks.
void send_to_system_log(const Line& text) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, "/dev/log", sizeof address.sun_path - 1);
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket < 0) return;
  Line line{};
  const int length =
      std::snprintf(line.data(), line.size(), "<27>%.500s", text.data());  // daemon.err
  static_cast<void>(!::sendto(socket, line.data(), static_cast<std::size_t>(length), 0,
                              reinterpret_cast<const sockaddr*>(&address), sizeof address));
  ::close(socket);
}

/// Call after the stops, which must not wait. A reader that would block the write gets no notice.
void write_notice(const NoticeText& notices, bool killed, const Stopped& done, std::size_t stages) {
  Line text{};
  std::snprintf(text.data(), text.size(),
                "%s; stop sent to %zu of %zu stages%s; inspect the rig, start again, then see "
                "weft status",
                (killed ? notices.killed : notices.died).c_str(), done.stopped, stages,
                done.lifted ? ", then the probe was retracted" : ", the probe was not retracted");
  append_to_log(notices.log, text);
  pollfd out{STDERR_FILENO, POLLOUT, 0};
  if (::poll(&out, 1, 0) > 0) {
    Line line{};
    const int length = std::snprintf(line.data(), line.size(), "%s%.500s\n",
                                     notices.is_journal ? "<3>" : "", text.data());
    static_cast<void>(!::write(STDERR_FILENO, line.data(), static_cast<std::size_t>(length)));
  }
  if (!notices.is_journal) send_to_system_log(text);
}

}  // namespace

std::vector<EmergencyStop> emergency_stops(const RigFile& rig, double lift_speed_mps) {
  std::vector<EmergencyStop> stops;
  for (const DeviceEntry& device : rig.devices) {
    if (device.driver != "thorlabs_apt") continue;
    EmergencyStop stop = apt_stop(device, rig.drivers.get(), lift_speed_mps);
    if (stop.message.empty()) continue;
    stop.addresses = addresses_of(device.link);
    stops.push_back(std::move(stop));
  }
  return stops;
}

Result<std::unique_ptr<Monitor>> Monitor::start(Settings settings) {
  const auto failed = [](const char* what) {
    return fail({.code = Errc::io,
                 .where = "monitor",
                 .what = what,
                 .got = std::generic_category().message(errno)});
  };
  void* memory =
      ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return failed("shared memory of the monitor not created");
  auto* shared = new (memory) Shared;
  std::array<int, 2> line{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, line.data()) != 0)
    return failed("sockets of the monitor not created");
  const pid_t host = ::getpid();
  const NoticeText notices = format_notices(host, settings);
  std::vector<int> kept = settings.locks;
  kept.push_back(line[0]);
  std::ranges::sort(kept);
  const pid_t child = ::fork();
  if (child < 0) return failed("monitor not started");
  if (child == 0) {
    close_all_except(kept);  // also the host's end: otherwise its closing would go unseen
    become_monitor();
    const HostEnd end = watch_host(*shared, line[0], host, settings.max_wait);
    if (end == HostEnd::farewell) ::_exit(0);
    const Stopped done = stop_stages(settings.stops, {shared->lift_from_m, shared->lift_to_m});
    write_notice(notices, end == HostEnd::killed, done, settings.stops.size());
    // Keeps the locks: a program that arms a stage stops it.
    if (!settings.locks.empty()) wait(done.lift_takes);
    ::_exit(0);
  }
  ::close(line[0]);
  return std::unique_ptr<Monitor>(new Monitor(shared, child, line[1]));
}

Monitor::~Monitor() {
  watch(false);
  while (::send(line_, &goodbye, 1, MSG_NOSIGNAL) < 0 && errno == EINTR) {
  }
  ::close(line_);
  if (!ended_) ::kill(process_, SIGCONT);  // a suspended process would never end
  while (!ended_ && ::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
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

void Monitor::plan_lift(std::optional<Lift> lift) {
  shared_->lift_from_m = lift ? lift->from_m : no_lift;
  shared_->lift_to_m = lift ? lift->to_m : no_lift;
}

bool Monitor::is_alive() {
  const pid_t seen = ended_ ? 0 : ::waitpid(process_, nullptr, WNOHANG);
  if (seen == process_ || (seen < 0 && errno == ECHILD)) ended_ = true;
  const auto now = steady_wall_now();
  const std::uint64_t rounds = shared_->rounds;
  // After a long interval between calls this process was suspended, and perhaps the monitor too.
  if (rounds != std::exchange(rounds_, rounds) || now - checked_at_ > own_stall) seen_at_ = now;
  checked_at_ = now;
  return !ended_ && now - seen_at_ <= default_timeout;
}

}  // namespace weft::daemon
