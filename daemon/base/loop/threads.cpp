#include "daemon/base/loop/threads.hpp"

#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace weft::daemon {
namespace {

std::string reason(int number) {
  return std::generic_category().message(number);
}

int schedule(int policy, int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  return ::sched_setscheduler(0, policy, &parameters) == 0 ? 0 : errno;
}

// Later threads and child processes do not inherit it: they are not the control loop.
int go_first(int priority) {
  return schedule(SCHED_FIFO | SCHED_RESET_ON_FORK, priority);
}

// Under a limit, a locked process would fail later, at an allocation. Then no memory is locked.
int lock_memory() {
  rlimit limit{};
  ::getrlimit(RLIMIT_MEMLOCK, &limit);
  if (limit.rlim_cur != RLIM_INFINITY && ::geteuid() != 0) return EPERM;
  return ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0 ? 0 : errno;
}

}  // namespace

RealTimeScope::RealTimeScope(int priority) {
  const int refused = go_first(priority);
  scheduled_ = refused == 0;
  if (!scheduled_)
    advice_ =
        "no real-time priority (" + reason(refused) + "; set rtprio in /etc/security/limits.conf)";
  const int unlocked = lock_memory();
  locked_ = unlocked == 0;
  if (!locked_)
    advice_ += (scheduled_ ? "memory not locked (" : ", memory not locked (") + reason(unlocked) +
               "; set memlock unlimited in /etc/security/limits.conf)";
}

RealTimeScope::~RealTimeScope() {
  if (locked_) ::munlockall();
  if (scheduled_) schedule(SCHED_OTHER, 0);
}

bool set_real_time_priority(int priority) {
  return go_first(priority) == 0;
}

void set_low_priority() {
  const sched_param none{};
  if (::sched_setscheduler(0, SCHED_IDLE, &none) == 0) return;
  constexpr int least_share = 19;
  // Linux also accepts the number of a thread.
  static_cast<void>(::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), least_share));
}

}  // namespace weft::daemon
