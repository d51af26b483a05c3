#include "daemon/base/loop/low_priority.hpp"

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

namespace weft::daemon {

void set_low_priority() {
  const sched_param none{};
  if (::sched_setscheduler(0, SCHED_IDLE, &none) == 0) return;
  constexpr int least_share = 19;
  // Linux takes the number of a thread as well.
  static_cast<void>(::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), least_share));
}

}  // namespace weft::daemon
