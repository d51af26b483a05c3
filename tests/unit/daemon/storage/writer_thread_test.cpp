// The thread that writes in the background of a control loop: order of errors, a disk that does not
// answer, its priority.

#include "daemon/storage/recorder/writer_thread.hpp"

#include <sched.h>

#include <catch2/catch.hpp>
#include <mutex>

#include "daemon/base/loop/threads.hpp"

namespace writer_thread_test {

using namespace weft;
using namespace weft::daemon;

TEST_CASE("an error of the writing thread comes back with a later call and stays") {
  WriterThread thread;
  REQUIRE(thread.post([] { return Status{}; }));
  REQUIRE(thread.drain());
  CHECK(thread.post([]() -> Status { return fail({.code = Errc::io, .what = "disk full"}); }));
  bool ran = false;
  static_cast<void>(thread.post([&]() -> Status {
    ran = true;
    return {};
  }));
  const Status drained = thread.drain();
  REQUIRE_FALSE(drained);
  CHECK(drained.error().what == "disk full");
  CHECK_FALSE(ran);
  CHECK_FALSE(thread.drain());
}

TEST_CASE(
    "the writing thread goes before other work, behind the control loop, where that is permitted") {
  if (!RealTimeScope().scheduled()) {
    WARN("skipped: real-time priority is not permitted here");
    return;
  }
  int policy = 0;
  sched_param given{};
  {
    WriterThread thread;
    REQUIRE(thread.post([&] {
      policy = ::sched_getscheduler(0);
      ::sched_getparam(0, &given);
      return Status{};
    }));
    REQUIRE(thread.drain());
  }
  CHECK((policy & ~SCHED_RESET_ON_FORK) == SCHED_FIFO);
  CHECK(given.sched_priority == WriterThread::priority);
  CHECK(::sched_getscheduler(0) == SCHED_OTHER);
}

TEST_CASE("a disk that does not respond blocks no caller, and is an error once too much waits") {
  std::mutex disk;
  disk.lock();
  bool refused = false;
  {
    WriterThread thread;
    for (std::size_t i = 0; i < 2 * WriterThread::most_waiting; ++i)
      refused = refused || !thread.post([&] {
        const std::lock_guard wait(disk);
        return Status{};
      });
    disk.unlock();
  }
  CHECK(refused);
}

}  // namespace writer_thread_test
