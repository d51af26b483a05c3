// Lateness of the control cycle on the real loop, compared with the kernel's own: cyclictest
// (Debian's rt-tests) runs in the same seconds, at the same priority and period.

#include <algorithm>
#include <cstdio>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/base/loop/real_loop.hpp"
#include "daemon/base/loop/threads.hpp"
#include "tests/bench/figures.hpp"

namespace {

using namespace weft;

constexpr Duration period = std::chrono::milliseconds(4);
constexpr std::size_t cycles = 2500;  // ten seconds

struct Kernel {
  double average_us = 0, worst_us = 0;
};

/// Zero if cyclictest is not installed or not permitted.
Kernel cyclictest() {
  Kernel seen;
  FILE* pipe = ::popen("cyclictest -q -m -t1 -p10 -i4000 -l2500 2>/dev/null", "r");
  if (pipe == nullptr) return seen;
  char line[512];
  while (std::fgets(line, sizeof line, pipe) != nullptr) {
    const std::string text(line);
    const auto number = [&](const char* key) {
      const auto at = text.find(key);
      return at == std::string::npos ? 0.0 : std::atof(text.c_str() + at + 4);
    };
    if (text.starts_with("T:")) seen = {number("Avg:"), number("Max:")};
  }
  ::pclose(pipe);
  return seen;
}

/// Lateness of each cycle [us], sorted.
std::vector<double> our_loop() {
  const daemon::RealTimeScope real_time;
  if (!real_time.advice().empty()) std::printf("jitter: %s\n", real_time.advice().c_str());
  daemon::RealLoop loop;
  std::vector<double> late_us;
  late_us.reserve(cycles);
  TimePoint due = loop.now();
  std::function<void()> cycle = [&] {
    late_us.push_back(1e6 * to_seconds(loop.now() - due));
    due = std::max(due + period, loop.now());
    loop.at(due, cycle);
  };
  loop.at(due += period, cycle);
  loop.run_until([&] { return late_us.size() >= cycles; });
  std::sort(late_us.begin(), late_us.end());
  return late_us;
}

}  // namespace

int main() {
  Kernel kernel;
  std::thread beside([&] { kernel = cyclictest(); });
  const std::vector<double> late = our_loop();
  beside.join();
  if (kernel.worst_us <= 0) {
    std::fprintf(stderr, "jitter: cyclictest gave no figures; it is in Debian's rt-tests\n");
    return 77;
  }
  double sum = 0;
  for (const double us : late) sum += us;
  const double period_us = 1e6 * to_seconds(period);
  const auto missed =
      std::count_if(late.begin(), late.end(), [&](double us) { return us >= period_us; });
  const std::string peer = "cyclictest, same seconds";
  return bench::report(
      "jitter", {{"cycle at 250 Hz late, mean", sum / static_cast<double>(late.size()), "us", peer,
                  kernel.average_us, "10 s, SCHED_FIFO 10 where permitted"},
                 {"cycle late, 99.9 %", late[late.size() * 999 / 1000], "us", "worst of cyclictest",
                  kernel.worst_us, ""},
                 {"cycle late, worst", late.back(), "us", peer, kernel.worst_us, ""},
                 {"deadlines missed (a whole period late)", static_cast<double>(missed), "of 2500",
                  "cycles", static_cast<double>(cycles), ""}});
}
