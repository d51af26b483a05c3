#include "daemon/base/loop/real_loop.hpp"

#include <catch2/catch.hpp>
#include <csignal>

namespace real_loop_test {

using namespace weft;
using namespace weft::daemon;
using namespace std::chrono_literals;

TEST_CASE("real timers run in the order of their times, ties in the order they were set") {
  RealLoop loop;
  std::string order;
  const TimePoint start = loop.now();
  loop.at(start + 4ms, [&] { order += 'c'; });
  loop.at(start + 2ms, [&] { order += 'a'; });
  loop.at(start + 2ms, [&] { order += 'b'; });
  loop.run_until([&] { return order.size() == 3; });
  CHECK(order == "abc");
  CHECK(loop.now() >= start + 4ms);
}

TEST_CASE("a real timer never runs early") {
  RealLoop loop;
  int early = 0, ran = 0;
  for (int i = 0; i < 40; ++i) {
    const TimePoint due = loop.now() + i * 130us;
    loop.at(due, [&, due] {
      ++ran;
      early += loop.now() < due;
    });
  }
  loop.run_until([&] { return ran == 40; });
  CHECK(early == 0);
}

TEST_CASE("a cancelled real timer does not run, and one set in the past follows what is due") {
  RealLoop loop;
  std::string order;
  const TimerId never = loop.after(1ms, [&] { order += 'x'; });
  loop.after(0ms, [&] { order += 'a'; });
  loop.at(TimePoint(-5s), [&] { order += 'b'; });
  loop.after(3ms, [&] { order += 'c'; });
  loop.cancel(never);
  loop.run_until([&] { return order.size() == 3; });
  CHECK(order == "abc");
}

TEST_CASE("a loop without timers or ports still sees a flag that a signal handler sets") {
  static volatile std::sig_atomic_t seen = 0;
  seen = 0;
  const auto before = std::signal(SIGUSR1, [](int) { seen = 1; });
  RealLoop loop;
  loop.after(1ms, [] { std::raise(SIGUSR1); });
  loop.run_until([] { return seen == 1; });
  std::signal(SIGUSR1, before);
  CHECK(seen == 1);
}

}  // namespace real_loop_test
