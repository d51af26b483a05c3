#include "daemon/loop/wall_clock.hpp"

namespace weft::daemon {

std::chrono::nanoseconds steady_wall_now() {
  return std::chrono::steady_clock::now().time_since_epoch();
}

double steady_wall_seconds() {
  return std::chrono::duration<double>(steady_wall_now()).count();
}

std::chrono::nanoseconds utc_now() {
  return std::chrono::system_clock::now().time_since_epoch();
}

}  // namespace weft::daemon
