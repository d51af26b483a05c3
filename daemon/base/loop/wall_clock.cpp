#include "daemon/base/loop/wall_clock.hpp"

#include <ctime>

namespace weft::daemon {

std::chrono::nanoseconds steady_wall_now() {
  return std::chrono::steady_clock::now().time_since_epoch();
}

double steady_wall_seconds() {
  return std::chrono::duration<double>(steady_wall_now()).count();
}

double process_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::chrono::nanoseconds utc_now() {
  return std::chrono::system_clock::now().time_since_epoch();
}

}  // namespace weft::daemon
