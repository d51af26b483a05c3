// weftd under load on the simulated rig: start, memory, latency compared with a bare echo on the
// same kind of socket, many subscribers of which some never read, and millions of requests.
// SIMULATED.
//   bench_weftd WEFTD      WEFT_BENCH_REQUESTS (10 000 000), WEFT_BENCH_SUBSCRIBERS (1000)

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/bench/figures.hpp"

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using weft::bench::Figure;

constexpr int starts = 11;
constexpr std::size_t requested = 20'000;
constexpr std::size_t in_a_batch = 50;
constexpr std::size_t never_reading = 10;
constexpr double changes_hz = 20;

[[noreturn]] void give_up(const char* what) {
  std::perror(what);
  std::exit(1);
}

std::size_t number_from(const char* variable, std::size_t otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

int connected(const fs::path& path) {
  const int wire = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  std::strncpy(at.sun_path, path.c_str(), sizeof at.sun_path - 1);
  if (wire < 0 || ::connect(wire, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0)
    give_up("connect");
  return wire;
}

void send_all(int wire, std::string_view text) {
  while (!text.empty()) {
    const ssize_t sent = ::send(wire, text.data(), text.size(), MSG_NOSIGNAL);
    if (sent <= 0) give_up("send");
    text.remove_prefix(static_cast<std::size_t>(sent));
  }
}

/// One end of a socket, line by line.
class Wire {
 public:
  explicit Wire(int descriptor) : descriptor_(descriptor) {}
  ~Wire() { ::close(descriptor_); }
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  [[nodiscard]] int descriptor() const { return descriptor_; }
  void send(std::string_view text) const { send_all(descriptor_, text); }
  std::string line() {
    std::size_t end = 0;
    while ((end = held_.find('\n')) == std::string::npos) fill();
    std::string out = held_.substr(0, end);
    held_.erase(0, end + 1);
    return out;
  }
  /// Reads `lines` lines and drops them.
  void skip(std::size_t lines) {
    while (lines > 0) {
      if (held_.empty()) fill();
      const auto here = static_cast<std::size_t>(std::count(held_.begin(), held_.end(), '\n'));
      if (here <= lines) {
        lines -= here;
        held_.erase(0, held_.rfind('\n') + 1);
        if (lines > 0) fill();
      } else {
        for (; lines > 0; --lines) held_.erase(0, held_.find('\n') + 1);
      }
    }
  }

 private:
  void fill() {
    char bytes[65536];
    const ssize_t got = ::recv(descriptor_, bytes, sizeof bytes, 0);
    if (got == 0) errno = ECONNRESET;  // a daemon without room closes the connection
    if (got <= 0) give_up("recv");
    held_.append(bytes, static_cast<std::size_t>(got));
  }

  int descriptor_;
  std::string held_;
};

std::string request(std::size_t id, std::string_view method, std::string_view params = "{}") {
  return R"({"jsonrpc":"2.0","id":)" + std::to_string(id) + R"(,"method":")" + std::string(method) +
         R"(","params":)" + std::string(params) + "}\n";
}

class Daemon {
 public:
  Daemon(const char* program, const fs::path& folder) : socket_(folder / "weftd.sock") {
    int out[2];
    if (::pipe(out) != 0) give_up("pipe");
    const auto begin = Clock::now();
    process_ = ::fork();
    if (process_ == 0) {
      ::dup2(out[1], STDOUT_FILENO);
      ::execl(program, program, "--rig", "sim/rigs/bench17.json", "--recipes", "recipes/library",
              "--data", (folder / "data").c_str(), "--socket", socket_.c_str(), nullptr);
      _exit(127);
    }
    ::close(out[1]);
    char text[64] = {};
    if (::read(out[0], text, sizeof text - 1) <= 0 || std::strncmp(text, "weftd: ready", 12) != 0)
      give_up("weftd does not start");
    ready_s_ = seconds_since(begin);
    ::close(out[0]);
  }
  ~Daemon() {
    ::kill(process_, SIGTERM);
    ::waitpid(process_, nullptr, 0);
  }
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  [[nodiscard]] double ready_s() const { return ready_s_; }
  [[nodiscard]] const fs::path& socket() const { return socket_; }
  [[nodiscard]] double resident_mb() const {
    std::ifstream file("/proc/" + std::to_string(process_) + "/statm");
    double pages = 0;
    file >> pages >> pages;
    return pages * static_cast<double>(::sysconf(_SC_PAGESIZE)) * 1e-6;
  }
  [[nodiscard]] double cpu_s() const {
    std::ifstream file("/proc/" + std::to_string(process_) + "/stat");
    std::string word;
    for (int i = 0; i < 13; ++i) file >> word;
    double user = 0, system = 0;
    file >> user >> system;
    return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
  }

 private:
  pid_t process_ = 0;
  fs::path socket_;
  double ready_s_ = 0;
};

std::unique_ptr<Wire> open_client(const Daemon& daemon) {
  auto wire = std::make_unique<Wire>(connected(daemon.socket()));
  wire->line();
  wire->send(request(0, "session.open", R"({"client":"bench","protocol":"1.x"})"));
  wire->line();
  return wire;
}

struct Latency {
  double p50_s = 0, p99_s = 0;
};

/// Latency of `count` requests, each after the answer to the previous one.
Latency latency_of(Wire& wire, std::size_t count) {
  const std::string text = request(1, "system.time");
  std::vector<double> all;
  for (std::size_t i = 0; i < count; ++i) {
    const auto begin = Clock::now();
    wire.send(text);
    wire.line();
    all.push_back(seconds_since(begin));
  }
  std::sort(all.begin(), all.end());
  return {all[count / 2], all[count * 99 / 100]};
}

/// Cost of a socket and two processes: the same lines, echoed unchanged.
Latency echo_latency() {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) give_up("socketpair");
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(ends[0]);
    char bytes[4096];
    for (ssize_t got = 0; (got = ::recv(ends[1], bytes, sizeof bytes, 0)) > 0;)
      send_all(ends[1], {bytes, static_cast<std::size_t>(got)});
    _exit(0);
  }
  ::close(ends[1]);
  Latency out;
  {
    Wire wire(ends[0]);
    out = latency_of(wire, requested);
  }
  ::waitpid(child, nullptr, 0);
  return out;
}

/// Start and end of the program without work [s].
double bare_start_s(const char* program) {
  const auto begin = Clock::now();
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(::open("/dev/null", O_WRONLY), STDOUT_FILENO);
    ::execl(program, program, "--version", nullptr);
    _exit(127);
  }
  ::waitpid(child, nullptr, 0);
  return seconds_since(begin);
}

void start(const char* program, const fs::path& folder, std::vector<Figure>& figures) {
  std::vector<double> ready, bare, resident;
  for (int i = 0; i < starts; ++i) {
    bare.push_back(bare_start_s(program));
    const Daemon daemon(program, folder);
    ready.push_back(daemon.ready_s());
    resident.push_back(daemon.resident_mb());
  }
  figures.push_back({"start to ready", 1e3 * weft::bench::median(ready), "ms", "weftd --version",
                     1e3 * weft::bench::median(bare), "", weft::bench::at_most(100)});
  figures.push_back({"resident memory when ready", weft::bench::median(resident), "MB", "asked", 20,
                     "", weft::bench::at_most(20)});
}

void latency(const Daemon& daemon, std::vector<Figure>& figures) {
  const auto client = open_client(daemon);
  latency_of(*client, requested / 10);
  const Latency ours = latency_of(*client, requested), bare = echo_latency();
  figures.push_back({"request on the Unix socket, p50", 1e6 * ours.p50_s, "us", "bare echo",
                     1e6 * bare.p50_s, "", weft::bench::at_most(50)});
  figures.push_back({"request on the Unix socket, p99", 1e6 * ours.p99_s, "us", "bare echo",
                     1e6 * bare.p99_s, "", weft::bench::at_most(200)});
}

/// Takes the received bytes of all readers without waiting; adds each one's lines to its count.
void drain(std::vector<pollfd>& readers, std::vector<std::size_t>& lines) {
  char bytes[65536];
  ::poll(readers.data(), readers.size(), 0);
  for (std::size_t i = 0; i < readers.size(); ++i) {
    if ((readers[i].revents & POLLIN) == 0) continue;
    const ssize_t got = ::recv(readers[i].fd, bytes, sizeof bytes, MSG_DONTWAIT);
    if (got > 0) lines[i] += static_cast<std::size_t>(std::count(bytes, bytes + got, '\n'));
  }
}

/// Acquires and releases the lease: an event each.
void change(Wire& maker) {
  maker.send(request(1, "lease.acquire"));
  const std::string reply = maker.line();
  const std::size_t at = reply.find("\"L-");
  if (at == std::string::npos) give_up(reply.c_str());
  const std::string lease = reply.substr(at, reply.find('"', at + 1) - at + 1);
  maker.send(request(2, "lease.release", R"({"lease":)" + lease + "}"));
  maker.line();
}

/// Number of events that the daemon dropped for a subscriber that did not read, from the first
/// event that reports it.
std::size_t left_out_for(Wire& silent) {
  constexpr std::string_view word = R"("dropped":)";
  for (;;) {
    const std::string line = silent.line();
    const std::size_t at = line.find(word);
    if (at == std::string::npos) continue;
    const std::size_t dropped = std::strtoull(line.c_str() + at + word.size(), nullptr, 10);
    if (dropped > 0) return dropped;
  }
}

/// Sends `changes_hz` events a second to all subscribers for ten seconds, after the queues of those
/// that never read have overflowed.
void subscribers(const Daemon& daemon, std::vector<Figure>& figures) {
  const std::size_t count =
      std::max(number_from("WEFT_BENCH_SUBSCRIBERS", 1000), never_reading + 1);
  constexpr std::size_t runs_over = 2000;  // changes: far more events than the daemon keeps for one
                                           // subscriber
  const auto maker = open_client(daemon), other = open_client(daemon);
  std::vector<std::unique_ptr<Wire>> all;
  std::vector<pollfd> readers;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; i == never_reading && k < runs_over; ++k) change(*maker);
    all.push_back(open_client(daemon));
    all.back()->send(request(1, "sub.open", R"({"topics":["*"],"mode":"every"})"));
    all.back()->line();
    if (i >= never_reading) readers.push_back({all.back()->descriptor(), POLLIN, 0});
  }
  std::vector<double> waits;
  std::vector<std::size_t> lines(readers.size());
  std::size_t changes = 0;
  const double cpu_s = daemon.cpu_s();
  const auto begin = Clock::now();
  while (seconds_since(begin) < 10) {
    change(*maker);
    changes += 2;
    drain(readers, lines);
    for (int i = 0; i < 10; ++i) waits.push_back(latency_of(*other, 1).p50_s);
    std::this_thread::sleep_until(
        begin + std::chrono::duration<double>(static_cast<double>(changes) / changes_hz));
  }
  const double share = (daemon.cpu_s() - cpu_s) / seconds_since(begin);
  std::this_thread::sleep_for(std::chrono::seconds(1));
  drain(readers, lines);
  std::sort(waits.begin(), waits.end());
  const auto [fewest, most] = std::minmax_element(lines.begin(), lines.end());
  const std::string who = std::to_string(count) + " subscribers, " + std::to_string(never_reading) +
                          " of whom never read: ";
  figures.push_back({who + "fewest events that a reader got", static_cast<double>(*fewest), "",
                     "events", static_cast<double>(changes),
                     "most " + std::to_string(*most) + "; " +
                         std::to_string(static_cast<int>(changes_hz)) + " a second to each",
                     weft::bench::at_least(static_cast<double>(changes))});
  figures.push_back({"left out for one that never reads",
                     static_cast<double>(left_out_for(*all[0])), "", "events",
                     static_cast<double>(2 * runs_over + changes),
                     "counted by the daemon and reported to it"});
  figures.push_back({"another client meanwhile, p99", 1e6 * waits[waits.size() * 99 / 100], "us",
                     "its median", 1e6 * waits[waits.size() / 2],
                     "worst " + std::to_string(1e6 * waits.back()) + " us"});
  figures.push_back({"processor time of the daemon meanwhile", share, "cores", "one core", 1, ""});
}

void millions(const Daemon& daemon, std::vector<Figure>& figures) {
  const std::size_t count = number_from("WEFT_BENCH_REQUESTS", 10'000'000);
  const auto client = open_client(daemon);
  std::string batch;
  for (std::size_t i = 0; i < in_a_batch; ++i) batch += request(i, "system.time");
  const auto query = [&](std::size_t requests) {
    for (std::size_t i = 0; i < requests / in_a_batch; ++i) {
      client->send(batch);
      client->skip(in_a_batch);
    }
  };
  query(count / 100);
  const double before_mb = daemon.resident_mb();
  const auto begin = Clock::now();
  query(count);
  const double spent_s = seconds_since(begin);
  figures.push_back(
      {"memory after " + std::to_string(count) + " requests", daemon.resident_mb(), "MB", "before",
       before_mb,
       std::to_string(static_cast<long>(static_cast<double>(count) / spent_s)) + " a second",
       weft::bench::ratio_at_most(1.01)});
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "bench_weftd WEFTD, from the repository's root\n");
    return 2;
  }
  rlimit files{};
  ::getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &files);
  const std::string program = fs::absolute(argv[1]);
  char name[] = "/tmp/weft-bench-XXXXXX";
  const fs::path folder = ::mkdtemp(name);
  std::vector<Figure> figures;
  start(program.c_str(), folder, figures);
  {
    const Daemon daemon(program.c_str(), folder);
    latency(daemon, figures);
    subscribers(daemon, figures);
    millions(daemon, figures);
  }
  fs::remove_all(folder);
  return weft::bench::report("weftd", figures);
}
