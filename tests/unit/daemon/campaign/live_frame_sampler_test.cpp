// What is shown of a run to who looks on, and how fast a simulated one passes.

#include <catch2/catch.hpp>

#include "daemon/campaign/bench_pace.hpp"
#include "daemon/campaign/live_frame_sampler.hpp"

namespace live_frame_sampler_test {

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
  LiveFrameSampler frame_sampler;
  frame_sampler.on_sample(pressed(5));
  frame_sampler.show({}, at(1s));
  CHECK_FALSE(frame_sampler.take());
}

TEST_CASE("a frame has the newest of each and the extremes of the normal force since the last") {
  LiveFrameSampler frame_sampler;
  frame_sampler.set_active(true);
  const std::vector<std::uint16_t> counts{7, 8, 9};
  Sample frame;
  frame.value = TaxelSample{counts, 0, 0, 0};
  frame_sampler.on_sample(frame);
  for (const double fz_n : {5.0, 6.5, 4.0, 5.2}) frame_sampler.on_sample(pressed(fz_n));
  Snapshot seen;
  seen.stage[0].position = 0.03;
  for (auto& known : seen.stage_at) known = at(0s);
  frame_sampler.show(seen, at(2s));
  frame_sampler.show(seen, at(3s));  // not asked for yet
  const auto shown = frame_sampler.take();
  REQUIRE(shown);
  CHECK(shown->bench_s == 2);
  REQUIRE(shown->wrench);
  CHECK(shown->wrench->force_n[2] == 5.2);
  CHECK(shown->least_fz_n == 4.0);
  CHECK(shown->most_fz_n == 6.5);
  CHECK(shown->taxels == counts);
  REQUIRE(shown->joints);
  CHECK((*shown->joints)[recipes::Axis::x] == 0.03);
  CHECK_FALSE(frame_sampler.take());

  frame_sampler.on_sample(pressed(3.0));
  frame_sampler.show(seen, at(4s));
  const auto next = frame_sampler.take();
  REQUIRE(next);
  CHECK(next->least_fz_n == 3.0);
  CHECK(next->most_fz_n == 3.0);
  CHECK(next->taxels.empty());  // no new frame of them
}

TEST_CASE("stages that have not all told where they are are not shown") {
  LiveFrameSampler frame_sampler;
  frame_sampler.set_active(true);
  frame_sampler.on_sample(pressed(1));
  frame_sampler.show({}, at(1s));
  const auto shown = frame_sampler.take();
  REQUIRE(shown);
  CHECK_FALSE(shown->joints);
}

TEST_CASE("who looks away is shown nothing old on coming back") {
  LiveFrameSampler frame_sampler;
  frame_sampler.set_active(true);
  frame_sampler.on_sample(pressed(1));
  frame_sampler.show({}, at(1s));
  frame_sampler.on_sample(pressed(9));
  frame_sampler.set_active(false);
  frame_sampler.set_active(true);
  CHECK_FALSE(frame_sampler.take());
  frame_sampler.show({}, at(9s));
  auto shown = frame_sampler.take();
  REQUIRE(shown);
  CHECK(shown->bench_s == 9);
  CHECK_FALSE(shown->wrench);
  frame_sampler.on_sample(pressed(2));
  frame_sampler.show({}, at(10s));
  shown = frame_sampler.take();
  REQUIRE(shown);
  CHECK(shown->most_fz_n == 2);
}

TEST_CASE("a run's first frame has nothing of the run before it") {
  LiveFrameSampler frame_sampler;
  frame_sampler.set_active(true);
  frame_sampler.on_sample(pressed(9));
  frame_sampler.show({}, at(1s));
  frame_sampler.on_sample(pressed(8));
  frame_sampler.begin();
  CHECK_FALSE(frame_sampler.take());
  frame_sampler.show({}, at(2s));
  const auto shown = frame_sampler.take();
  REQUIRE(shown);
  CHECK_FALSE(shown->wrench);
}

TEST_CASE("a bench is ahead of its pace by what has passed too fast") {
  BenchPace requested = 4;
  PaceKeeper keeper(&requested);
  CHECK(keeper.ahead(at(10s), 100s) == 0s);  // from here
  CHECK(keeper.ahead(at(14s), 100s) == 1s);
  CHECK(keeper.ahead(at(14s), 100s + 400ms) == 600ms);
  CHECK(keeper.ahead(at(14s), 101s) == 0s);
}

TEST_CASE("a bench that fell behind does not catch up") {
  BenchPace requested = 1;
  PaceKeeper keeper(&requested);
  CHECK(keeper.ahead(at(0s), 0s) == 0s);
  CHECK(keeper.ahead(at(1s), 61s) == 0s);  // it was held for a minute
  CHECK(keeper.ahead(at(2s), 61s) == 1s);
}

TEST_CASE("a pace set anew counts from then") {
  BenchPace requested = 1;
  PaceKeeper keeper(&requested);
  CHECK(keeper.ahead(at(0s), 0s) == 0s);
  CHECK(keeper.ahead(at(8s), 0s) == 8s);
  requested = 0;
  CHECK(keeper.ahead(at(8s), 0s) == 0s);
  requested = 2;
  CHECK(keeper.ahead(at(8s), 0s) == 0s);
  CHECK(keeper.ahead(at(10s), 0s) == 1s);
  CHECK_FALSE(is_pace(0.5));
  CHECK_FALSE(is_pace(-1));
  CHECK(is_pace(0));
  CHECK(is_pace(1));
}

}  // namespace live_frame_sampler_test
