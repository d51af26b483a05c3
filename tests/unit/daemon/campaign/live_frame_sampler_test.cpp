// Live samples of a run for viewers, and the simulation speed.

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

TEST_CASE("a frame has the newest of each and the extremes of the normal force since the last") {
  LiveFrameSampler frame_sampler;
  const std::vector<std::uint16_t> counts{7, 8, 9};
  Sample frame;
  frame.value = TaxelSample{counts, 0, 0, 0};
  frame_sampler.on_sample(frame, Phase::none);
  for (const double fz_n : {5.0, 6.5, 4.0, 5.2})
    frame_sampler.on_sample(pressed(fz_n), Phase::none);
  Snapshot seen;
  seen.stage[0].position = 0.03;
  for (auto& known : seen.stage_at) known = at(0s);
  frame_sampler.show(seen, at(2s));
  frame_sampler.show(seen, at(3s));  // not requested yet
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

  frame_sampler.on_sample(pressed(3.0), Phase::none);
  frame_sampler.show(seen, at(4s));
  const auto next = frame_sampler.take();
  REQUIRE(next);
  CHECK(next->least_fz_n == 3.0);
  CHECK(next->most_fz_n == 3.0);
  CHECK(next->taxels.empty());  // no new taxel frame
}

TEST_CASE("stages are not shown before all positions are known") {
  LiveFrameSampler frame_sampler;
  frame_sampler.on_sample(pressed(1), Phase::none);
  frame_sampler.show({}, at(1s));
  const auto shown = frame_sampler.take();
  REQUIRE(shown);
  CHECK_FALSE(shown->joints);
}

TEST_CASE("of every 0.2 s there is a row, with its phase and the set point") {
  recipes::Exploration exploration;
  exploration.phases.resize(1);
  exploration.phases[0].phase = Phase::press;
  exploration.phases[0].force_n = 5;
  exploration.phases[0].force_band_n = 0.25;
  LiveFrameSampler frame_sampler;
  frame_sampler.begin("R-000007");
  frame_sampler.begin_trial(exploration);
  for (int k = 0; k <= 20; ++k) {  // every 0.05 s; frames are not taken
    frame_sampler.on_sample(pressed(k), k < 10 ? Phase::rest : Phase::press);
    frame_sampler.show({}, at(k * 50ms));
  }
  const LiveHistory history = frame_sampler.history(-1);
  CHECK(history.run == "R-000007");
  REQUIRE(history.rows.size() == 6);
  CHECK(history.rows[1].bench_s == 0.2);
  CHECK(history.rows[1].least_fz_n == 1);
  CHECK(history.rows[1].most_fz_n == 4);
  CHECK(history.rows[1].force_n == 0);
  CHECK(history.rows[3].phase == Phase::press);
  CHECK(history.rows[3].force_n == 5);
  CHECK(history.rows[3].force_band_n == 0.25);
  CHECK(frame_sampler.history(0.4).rows.size() == 3);
  frame_sampler.begin("R-000008");
  CHECK(frame_sampler.history(-1).rows.empty());
}

TEST_CASE("counts come with their mean in the newest phase S") {
  LiveFrameSampler frame_sampler;
  const auto feel = [&](std::uint16_t first, Phase phase) {
    const std::vector<std::uint16_t> counts{first, 100};
    Sample frame;
    frame.value = TaxelSample{counts, 0, 0, 0};
    frame_sampler.on_sample(frame, phase);
  };
  feel(900, Phase::rest);
  feel(500, Phase::none);
  feel(10, Phase::rest);
  feel(13, Phase::rest);
  feel(80, Phase::motion);
  frame_sampler.show({}, at(1s));
  const auto shown = frame_sampler.take();
  REQUIRE(shown);
  CHECK(shown->taxels == std::vector<std::uint16_t>{80, 100});
  CHECK(shown->rest_counts == std::vector{11.5, 100.0});
  CHECK(frame_sampler.history(-1).rows.back().rest_counts == shown->rest_counts);
}

TEST_CASE("a run's first frame has nothing of the run before it") {
  LiveFrameSampler frame_sampler;
  frame_sampler.on_sample(pressed(9), Phase::none);
  frame_sampler.show({}, at(1s));
  frame_sampler.on_sample(pressed(8), Phase::none);
  frame_sampler.begin("R-000001");
  CHECK_FALSE(frame_sampler.take());
  frame_sampler.show({}, at(2s));
  const auto shown = frame_sampler.take();
  REQUIRE(shown);
  CHECK_FALSE(shown->wrench);
}

TEST_CASE("a bench is ahead of its pace by what has passed too fast") {
  BenchPace requested = 4;
  PaceKeeper keeper(&requested);
  CHECK(keeper.ahead(at(10s), 100s) == 0s);  // the anchor
  CHECK(keeper.ahead(at(14s), 100s) == 1s);
  CHECK(keeper.ahead(at(14s), 100s + 400ms) == 600ms);
  CHECK(keeper.ahead(at(14s), 101s) == 0s);
}

TEST_CASE("a bench that fell behind does not catch up") {
  BenchPace requested = 1;
  PaceKeeper keeper(&requested);
  CHECK(keeper.ahead(at(0s), 0s) == 0s);
  CHECK(keeper.ahead(at(1s), 61s) == 0s);  // the bench was held for a minute
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
