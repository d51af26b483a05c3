// The time left of a run: before its first trial, as trials end, held, with operator steps, at
// another simulation speed.

#include "daemon/campaign/orders/run_forecast.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/daemon/benches/trial_bench.hpp"
#include "tests/unit/recipes/bench.hpp"

namespace run_forecast_test {

using namespace weft;
using namespace weft::daemon;
using namespace std::chrono_literals;
using recipes::Step;

namespace {

// 10 trials of 60 s, 30 s afterwards, operator steps of 100 s in all.
constexpr PlannedTime plan{
    .trials = 10, .trial_s = 60, .finally_s = 30, .people_s = 100, .is_real_time = false};
constexpr PlannedTime real{
    .trials = 10, .trial_s = 60, .finally_s = 30, .people_s = 100, .is_real_time = true};
const recipes::StepPrompt mount{.text = "Mount silk.", .people_s = 20};

RunForecast begun(const PlannedTime& planned, double pace) {
  RunForecast run(planned);
  run.on_step(Step::clearing, 20, pace, 0s);
  return run;
}

}  // namespace

TEST_CASE("the plan gives the time left before the first trial, at any pace that is known") {
  const RunForecast waits(plan);
  CHECK(waits.left_s(1, 0s) == Approx(730));
  CHECK(waits.left_s(10, 5s) == Approx(163));
  CHECK_FALSE(waits.left_s(0, 0s));  // as fast as possible: nothing is measured
  CHECK_FALSE(waits.left_until_s(3, 1, 0s));
  CHECK_FALSE(RunForecast().left_s(1, 0s));
  RunForecast run(plan);
  run.on_step(Step::clearing, 20, 1, 100s);
  CHECK(run.left_s(1, 130s) == Approx(700));
  CHECK(run.left_s(1, 1000s) == Approx(670));  // at most one unobserved trial counts
  CHECK(run.trial_left_s(1, 130s) == Approx(30));
  CHECK(run.left_until_s(2, 1, 130s) == Approx(90));
}

TEST_CASE("trials done correct it, and it counts down between them") {
  RunForecast run = begun(plan, 1);
  run.on_trial(1, 140, 1, 120s);  // twice as long as planned
  CHECK(run.left_s(1, 120s) == Approx(9 * 120 + 30 + 100));
  CHECK(run.left_s(1, 180s) == Approx(9 * 120 - 60 + 30 + 100));
  CHECK(run.left_until_s(1, 1, 180s) == Approx(0));
  CHECK(run.left_until_s(3, 1, 180s) == Approx(2 * 120 - 60));
  CHECK_FALSE(run.left_until_s(0, 1, 180s));
  run.on_trial(2, 200, 1, 180s);
  CHECK(run.left_s(1, 180s) == Approx(8 * 90 + 30 + 100));
  run.on_trial(10, 800, 1, 780s);
  CHECK(run.trial_left_s(1, 780s) == Approx(0));
}

TEST_CASE("another pace counts at once") {
  RunForecast run = begun(plan, 60);
  run.on_trial(1, 80, 60, 1s);
  CHECK(run.left_s(60, 1s) == Approx(9 + 0.5 + 100));
  CHECK(run.left_s(1, 1s) == Approx(540 + 30 + 100));
  CHECK_FALSE(run.left_s(0, 1s));
  run.on_trial(2, 140, 0, 2s);
  CHECK_FALSE(run.left_s(0, 2s));  // the simulation speed changed within that trial
  run.on_trial(3, 200, 0, 3s);
  CHECK(run.left_s(0, 3s) == Approx(7 + 0.5 + 100));
}

TEST_CASE("a bench that does not keep its pace is forecast by what it does") {
  RunForecast run = begun(plan, 60);
  run.on_trial(1, 80, 60, 4s);  // 15 times, not 60
  CHECK(run.left_s(60, 4s) == Approx(540 / 15.0 + 2 + 100));
  RunForecast other = begun(real, 60);  // only simulated benches have a simulation speed
  other.on_trial(1, 80, 60, 60s);
  CHECK(other.left_s(60, 60s) == Approx(540 + 30 + 100));
}

TEST_CASE("no time passes while it is held, on no bench") {
  for (const PlannedTime& planned : {plan, real}) {
    RunForecast run = begun(planned, 1);
    run.on_trial(1, 80, 1, 60s);
    run.on_step(Step::held, 90, 1, 70s);
    CHECK(run.left_s(1, 70s) == Approx(650 + 10));
    CHECK(run.left_s(1, 5000s) == Approx(650 + 10));
    CHECK_FALSE(run.left_until_s(2, 1, 5000s));
    const double hold_s = planned.is_real_time ? 4930 : 0;
    run.on_step(Step::clearing, 90 + hold_s, 1, 5000s);
    CHECK(run.left_s(1, 5010s) == Approx(640 + 10));
    run.on_trial(2, 140 + hold_s, 1, 5050s);
    CHECK(run.left_s(1, 5050s) == Approx(8 * 60 + 30 + 100));
  }
}

TEST_CASE("people take as much longer as they have so far, and count for what is left to ask") {
  RunForecast run = begun(plan, 1);
  run.on_step(Step::awaiting_operator, 20, 1, 0s);
  CHECK_FALSE(run.left_until_s(2, 1, 10s));
  run.on_confirmed(mount);
  run.on_step(Step::clearing, 20, 1, 40s);  // twice as long as the recipe states
  CHECK(run.left_s(1, 40s) == Approx(630 + 2 * 80));
  run.skip_prompt(mount);
  CHECK(run.left_s(1, 40s) == Approx(630 + 2 * 60));
}

TEST_CASE("a resumed run has the rest of its plan to do") {
  PlannedTime rest = plan;
  rest.first = 8;
  RunForecast run = begun(rest, 1);
  CHECK(run.left_s(1, 0s) == Approx(120 + 30 + 100));
  run.on_trial(9, 140, 1, 120s);
  CHECK(run.left_s(1, 120s) == Approx(120 + 30 + 100));
  CHECK(run.left_until_s(9, 1, 130s) == Approx(0));
}

TEST_CASE("a plan's time is that of its trials, of what comes finally, and of people") {
  const recipes::Plan whole = recipes::test::plan_of(
      test::with_keys(R"("finally":{"on_success":[{"do":"wait","duration_s":100}]})"));
  const PlannedTime time = PlannedTime::of(whole, 1, true);
  CHECK(time.finally_s == 100);
  CHECK(time.first == 1);
  CHECK(static_cast<double>(time.trials) * time.trial_s + time.finally_s ==
        Approx(whole.forecast.duration_s));
  CHECK(RunForecast(PlannedTime::of(whole, 0, true)).left_s(0, 0s) ==
        Approx(whole.forecast.duration_s));
}

}  // namespace run_forecast_test
