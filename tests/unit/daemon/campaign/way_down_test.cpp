// The approach and its guards on a simulated bench: fast, slow, on slow stages, in slow cycles.

#include <nlohmann/json.hpp>

#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace way_down_test {

using namespace weft;
using namespace weft::daemon;
using test::Guarded;

namespace {

/// bench17 with linear stages that have this acceleration limit.
nlohmann::json accelerating(double mm_s2) {
  nlohmann::json rig = test::bench17();
  rig["limits"]["acceleration_mm_s2"] = mm_s2;
  for (const char* role : {"x", "y", "z"})
    test::device_of(rig, role)["config"].erase("acceleration_mm_s2");
  return rig;
}

}  // namespace

TEST_CASE("a fast way down and a slow one onto the cloth are no following error") {
  for (const char* const approach :
       {R"("approach":{"speed_mm_s":4})", R"("approach":{"seat_speed_mm_s":0.05})",
        R"("approach":{"speed_mm_s":4,"seat_speed_mm_s":0.02})"}) {
    CAPTURE(approach);
    Guarded g(test::with_keys(approach));
    g.start();
    g.run_to(recipes::Step::resting);
    CHECK_FALSE(g.bench.trial_error);
  }
}

TEST_CASE("a way down on stages that accelerate slowly is no following error") {
  for (const double acceleration_mm_s2 : {2, 5})
    for (const double speed_mm_s : {2, 4}) {
      CAPTURE(acceleration_mm_s2, speed_mm_s);
      Guarded g(test::with_keys(R"("approach":{"speed_mm_s":)" + std::to_string(speed_mm_s) + "}"),
                accelerating(acceleration_mm_s2));
      g.start();
      g.run_to(recipes::Step::resting);
      CHECK_FALSE(g.bench.trial_error);
    }
}

TEST_CASE(
    "a sensor that loses its zero on the way down is not believed beyond the probe's weight") {
  nlohmann::json rig = test::bench17();
  rig["limits"]["force_cap_N"] = 7;
  for (const double amount_n : {-2.9, 2.9}) {
    CAPTURE(amount_n);
    Guarded g(test::short_recipe("denim"), rig);
    g.start();
    g.run_to(recipes::Step::approaching);
    const TimePoint then = g.bench.sim.loop.now() + std::chrono::seconds(1);
    g.bench.sim.loop.run_until([&] { return g.bench.sim.loop.now() >= then; });
    REQUIRE(g.supervisor->state().step == recipes::Step::approaching);
    const nlohmann::json hit{{"device", "ft"}, {"fault", "bias_jump"}, {"amount", amount_n}};
    REQUIRE(g.bench.sim.rig->inject(hit.dump(), g.bench.sim.loop.now()));
    g.finish();
    REQUIRE(g.bench.trial_error);
    CHECK_THAT(g.bench.trial_error->what, Catch::Contains("jumped"));
  }
}

TEST_CASE("a landing on stiff cloth under a low cap is no jump of the force, a jump is one") {
  nlohmann::json rig = test::bench17();
  rig["limits"]["force_cap_N"] = 3.2;
  const std::string gentle =
      test::changed(test::with_keys(R"("approach":{"speed_mm_s":4})", "nylon"), "\"force_N\":5",
                    "\"force_N\":2.5");
  Guarded good(gentle, rig);
  good.start();
  good.finish();
  CHECK(good.supervisor->result()->outcome == recipes::Outcome::complete);
  Guarded with_fault(gentle, rig);
  with_fault.start();
  with_fault.run_to(recipes::Step::sliding);
  const nlohmann::json hit{{"device", "ft"}, {"fault", "bias_jump"}, {"amount", -1.5}};
  REQUIRE(with_fault.bench.sim.rig->inject(hit.dump(), with_fault.bench.sim.loop.now()));
  with_fault.finish();
  REQUIRE(with_fault.bench.trial_error);
  CHECK_THAT(with_fault.bench.trial_error->what, Catch::Contains("jumped"));
}

TEST_CASE("in a slow scan cycle no stage of a good campaign is found off its command") {
  for (const double acceleration_mm_s2 : {3, 4, 6, 20}) {
    CAPTURE(acceleration_mm_s2);
    nlohmann::json rig = accelerating(acceleration_mm_s2);
    rig["control"]["cycle_hz"] = 10;
    Guarded g(test::with_keys(R"("approach":{"speed_mm_s":1})"), rig);
    g.start();
    g.finish();
    CHECK(g.supervisor->result()->outcome == recipes::Outcome::complete);
  }
}

TEST_CASE("z has the time to come back to rest, however far a fast way down has taken it") {
  for (const double speed_mm_s : {2, 4})
    for (const double rest_travel_mm : {0.0, 0.05}) {
      CAPTURE(speed_mm_s, rest_travel_mm);
      nlohmann::json rig = test::bench17();
      rig["probe"]["rest_travel_mm"] = rest_travel_mm;
      Guarded g(test::with_keys(R"("approach":{"seat_speed_mm_s":0.02,"speed_mm_s":)" +
                                    std::to_string(speed_mm_s) + "}",
                                "nylon"),
                rig);
      g.start();
      g.run_to(recipes::Step::resting);
      CHECK_FALSE(g.bench.trial_error);
    }
}

TEST_CASE("a sensor that loses the probe's weight while z goes back to rest is not believed") {
  nlohmann::json rig = test::bench17();
  rig["limits"]["force_cap_N"] = 4;
  Guarded g(test::changed(test::with_keys(R"("approach":{"speed_mm_s":0.1})"), "\"force_N\":5",
                          "\"force_N\":2.5"),
            rig);
  g.start();
  g.run_to(recipes::Step::unloading);
  const TimePoint then = g.bench.sim.loop.now() + std::chrono::milliseconds(300);
  g.bench.sim.loop.run_until([&] { return g.bench.sim.loop.now() >= then; });
  REQUIRE(g.supervisor->state().step == recipes::Step::unloading);
  const nlohmann::json hit{{"device", "ft"}, {"fault", "bias_jump"}, {"amount", -2.2}};
  REQUIRE(g.bench.sim.rig->inject(hit.dump(), g.bench.sim.loop.now()));
  g.finish();
  REQUIRE(g.bench.trial_error);
  CHECK_THAT(g.bench.trial_error->what, Catch::Contains("jumped"));
}

}  // namespace way_down_test
