#include <catch2/catch.hpp>

#include "daemon/base/loop/timed_loop.hpp"
#include "daemon/hardware/link/memory_link.hpp"

namespace loop_test {

using namespace weft;
using namespace weft::daemon;
using namespace std::chrono_literals;

TEST_CASE("virtual time jumps from timer to timer, ties in the order they were set") {
  VirtualLoop loop;
  std::string order;
  loop.after(2s, [&] { order += 'c'; });
  loop.after(1s, [&] { order += 'a'; });
  loop.after(1s, [&] { order += 'b'; });
  while (loop.run_one()) {
  }
  CHECK(order == "abc");
  CHECK(loop.now() == TimePoint(2s));
}

TEST_CASE("a cancelled timer does not run and does not move the clock") {
  VirtualLoop loop;
  int ran = 0;
  const TimerId id = loop.after(5s, [&] { ++ran; });
  loop.after(1s, [&] { ++ran; });
  loop.cancel(id);
  while (loop.run_one()) {
  }
  CHECK(ran == 1);
  CHECK(loop.now() == TimePoint(1s));
}

TEST_CASE("the id of a timer that is over cancels no later one") {
  VirtualLoop loop;
  int ran = 0;
  const TimerId cancelled = loop.after(1s, [&] { ++ran; });
  loop.cancel(cancelled);
  const TimerId over = loop.after(1s, [&] { ++ran; });
  REQUIRE(loop.run_one());
  loop.after(1s, [&] { ++ran; });
  loop.cancel(cancelled);
  loop.cancel(over);
  while (loop.run_one()) {
  }
  CHECK(ran == 2);
}

TEST_CASE("a timer in the past runs at once, never backwards") {
  VirtualLoop loop;
  loop.run_to(TimePoint(3s));
  TimePoint seen{};
  loop.at(TimePoint(1s), [&] { seen = loop.now(); });
  CHECK(loop.run_one());
  CHECK(seen == TimePoint(3s));
}

TEST_CASE("bytes arrive in order, after the latency, stamped with their arrival") {
  VirtualLoop loop;
  auto [host, device] = MemoryLink::make_pair(loop, loop, 2ms);
  Bytes got;
  std::vector<TimePoint> stamps;
  device->on_receive([&](ByteView b, TimePoint t) {
    got.insert(got.end(), b.begin(), b.end());
    stamps.push_back(t);
  });
  const Bytes one{1, 2};
  const Bytes two{3};
  REQUIRE(host->write(one));
  loop.after(1ms, [&, &link = *host] { REQUIRE(link.write(two)); });
  while (loop.run_one()) {
  }
  CHECK(got == Bytes{1, 2, 3});
  CHECK(stamps == std::vector<TimePoint>{TimePoint(2ms), TimePoint(3ms)});
}

TEST_CASE("a pipe without its ends delivers nothing") {
  VirtualLoop loop;
  int received = 0;
  auto [host, device] = MemoryLink::make_pair(loop, loop, 1ms);
  device->on_receive([&](ByteView, TimePoint) { ++received; });
  REQUIRE(host->write(Bytes{1}));
  host.reset();
  device.reset();
  CHECK_FALSE(loop.run_one());
  CHECK(received == 0);
}

TEST_CASE("unplugging notifies both ends once, drops bytes in transit and refuses writes") {
  VirtualLoop loop;
  auto [host, device] = MemoryLink::make_pair(loop, loop, 1ms);
  int reported = 0;
  int received = 0;
  host->on_closed([&](const Error&) { ++reported; });
  device->on_closed([&](const Error&) { ++reported; });
  device->on_receive([&](ByteView, TimePoint) { ++received; });
  const Bytes data{1};
  REQUIRE(host->write(data));
  device->unplug();
  device->unplug();
  while (loop.run_one()) {
  }
  CHECK(reported == 2);
  CHECK(received == 0);
  CHECK(host->write(data).error().code == Errc::io);
}

TEST_CASE("a link end that is destroyed while bytes are under way is not called") {
  VirtualLoop loop;
  auto [host, device] = MemoryLink::make_pair(loop, loop, 1ms);
  bool called = false;
  device->on_receive([&](ByteView, TimePoint) { called = true; });
  const Bytes data{1};
  REQUIRE(host->write(data));
  device.reset();
  while (loop.run_one()) {
  }
  CHECK_FALSE(called);
}

}  // namespace loop_test
