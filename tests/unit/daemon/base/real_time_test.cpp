// The kernel's settings of a thread and its process inside a RealTimeScope, and after it.

#include "daemon/base/loop/threads.hpp"

#include <sched.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <thread>

namespace real_time_test {

using namespace weft::daemon;

namespace {

struct Standing {
  int policy = -1, priority = -1;
  long locked_kb = -1;
};

/// Settings of the calling thread and, for the memory, of the process.
Standing standing() {
  Standing out;
  out.policy = ::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
  sched_param parameters{};
  if (::sched_getparam(0, &parameters) == 0) out.priority = parameters.sched_priority;
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (word == "VmLck:") status >> out.locked_kb;
  return out;
}

}  // namespace

TEST_CASE("only inside a real-time scope the thread has SCHED_FIFO and the memory is locked") {
  const Standing before = standing();
  REQUIRE(before.locked_kb >= 0);
  {
    const RealTimeScope scope(7);
    const Standing inside = standing();
    if (scope.scheduled()) {
      CHECK(inside.policy == SCHED_FIFO);
      CHECK(inside.priority == 7);
      Standing child;  // a thread made inside is not the control loop
      std::thread([&] { child = standing(); }).join();
      CHECK(child.policy == SCHED_OTHER);
    } else {
      CHECK(inside.policy == before.policy);
      CHECK_THAT(scope.advice(), Catch::Contains("rtprio"));
      WARN("SCHED_FIFO is not permitted here: not looked at");
    }
    if (scope.locked()) {
      CHECK(inside.locked_kb > before.locked_kb);
    } else {
      CHECK(inside.locked_kb == before.locked_kb);
      CHECK_THAT(scope.advice(), Catch::Contains("memlock"));
      WARN("memory may not be locked here: not looked at");
    }
  }
  const Standing after = standing();
  CHECK(after.policy == SCHED_OTHER);  // whatever the policy was before
  CHECK(after.priority == 0);
  CHECK(after.locked_kb == before.locked_kb);
}

}  // namespace real_time_test
