// What is shown of a run to who looks on, and how fast a simulated one passes.

#include <catch2/catch.hpp>

#include "daemon/campaign/bench_pace.hpp"
#include "daemon/campaign/onlooker.hpp"

namespace onlooker_test {

using namespace weft;
using namespace weft::daemon;
using namespace std::chrono_literals;

namespace {

Sample pressed(double fz_n) {
  Sample out;
  WrenchSample wrench;
  wrench.force_n = {0.1, -0.2, fz_n};
  out.value = wrench;
  return out;
}

TimePoint at(Duration since) {
  return TimePoint{} + since;
}

}  // namespace

TEST_CASE("nobody looks: nothing is kept") {
  Onlooker onlooker;
  onlooker.hear(pressed(5));
  onlooker.show({}, at(1s));
  CHECK_FALSE(onlooker.take());
}

TEST_CASE("a frame has the newest of each and the extremes of the normal force since the last") {
  Onlooker onlooker;
  onlooker.look(true);
  const std::vector<std::uint16_t> counts{7, 8, 9};
  Sample frame;
  frame.value = TaxelSample{counts, 0, 0, 0};
  onlooker.hear(frame);
  for (const double fz_n : {5.0, 6.5, 4.0, 5.2}) onlooker.hear(pressed(fz_n));
  Snapshot seen;
  seen.stage[0].position = 0.03;
  for (auto& known : seen.stage_at) known = at(0s);
  onlooker.show(seen, at(2s));
  onlooker.show(seen, at(3s));  // not asked for yet
  const auto shown = onlooker.take();
  REQUIRE(shown);
  CHECK(shown->bench_s == 2);
  REQUIRE(shown->wrench);
  CHECK(shown->wrench->force_n[2] == 5.2);
  CHECK(shown->least_fz_n == 4.0);
  CHECK(shown->most_fz_n == 6.5);
  CHECK(shown->taxels == counts);
  REQUIRE(shown->joints);
  CHECK((*shown->joints)[recipes::Axis::x] == 0.03);
  CHECK_FALSE(onlooker.take());

  onlooker.hear(pressed(3.0));
  onlooker.show(seen, at(4s));
  const auto next = onlooker.take();
  REQUIRE(next);
  CHECK(next->least_fz_n == 3.0);
  CHECK(next->most_fz_n == 3.0);
  CHECK(next->taxels.empty());  // no new frame of them
}

TEST_CASE("stages that have not all told where they are are not shown") {
  Onlooker onlooker;
  onlooker.look(true);
  onlooker.hear(pressed(1));
  onlooker.show({}, at(1s));
  const auto shown = onlooker.take();
  REQUIRE(shown);
  CHECK_FALSE(shown->joints);
}

TEST_CASE("who looks away is shown nothing old on coming back") {
  Onlooker onlooker;
  onlooker.look(true);
  onlooker.hear(pressed(1));
  onlooker.show({}, at(1s));
  onlooker.hear(pressed(9));
  onlooker.look(false);
  onlooker.look(true);
  CHECK_FALSE(onlooker.take());
  onlooker.show({}, at(9s));
  auto shown = onlooker.take();
  REQUIRE(shown);
  CHECK(shown->bench_s == 9);
  CHECK_FALSE(shown->wrench);
  onlooker.hear(pressed(2));
  onlooker.show({}, at(10s));
  shown = onlooker.take();
  REQUIRE(shown);
  CHECK(shown->most_fz_n == 2);
}

TEST_CASE("a run's first frame has nothing of the run before it") {
  Onlooker onlooker;
  onlooker.look(true);
  onlooker.hear(pressed(9));
  onlooker.show({}, at(1s));
  onlooker.hear(pressed(8));
  onlooker.begin();
  CHECK_FALSE(onlooker.take());
  onlooker.show({}, at(2s));
  const auto shown = onlooker.take();
  REQUIRE(shown);
  CHECK_FALSE(shown->wrench);
}

TEST_CASE("a bench is ahead of its pace by what has passed too fast") {
  BenchPace asked = 4;
  PaceKeeper keeper(&asked);
  CHECK(keeper.ahead(at(10s), 100s) == 0s);  // from here
  CHECK(keeper.ahead(at(14s), 100s) == 1s);
  CHECK(keeper.ahead(at(14s), 100s + 400ms) == 600ms);
  CHECK(keeper.ahead(at(14s), 101s) == 0s);
}

TEST_CASE("a bench that fell behind does not catch up") {
  BenchPace asked = 1;
  PaceKeeper keeper(&asked);
  CHECK(keeper.ahead(at(0s), 0s) == 0s);
  CHECK(keeper.ahead(at(1s), 61s) == 0s);  // it was held for a minute
  CHECK(keeper.ahead(at(2s), 61s) == 1s);
}

TEST_CASE("a pace set anew counts from then") {
  BenchPace asked = 1;
  PaceKeeper keeper(&asked);
  CHECK(keeper.ahead(at(0s), 0s) == 0s);
  CHECK(keeper.ahead(at(8s), 0s) == 8s);
  asked = 0;
  CHECK(keeper.ahead(at(8s), 0s) == 0s);
  asked = 2;
  CHECK(keeper.ahead(at(8s), 0s) == 0s);
  CHECK(keeper.ahead(at(10s), 0s) == 1s);
  CHECK_FALSE(is_pace(0.5));
  CHECK_FALSE(is_pace(-1));
  CHECK(is_pace(0));
  CHECK(is_pace(1));
}

}  // namespace onlooker_test
