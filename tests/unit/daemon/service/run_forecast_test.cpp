// The time left of a run, before its first trial, as trials end, held, and at another pace.

#include "daemon/service/run_model/run_forecast.hpp"

#include <catch2/catch.hpp>

namespace run_forecast_test {

using namespace weft::daemon::runs;
using namespace std::chrono_literals;

namespace {

// 10 trials of 60 s, 30 s afterwards, people for 100 s in all.
const PlannedTime plan{600, 30, 100, 10};

}  // namespace

TEST_CASE("the plan gives the time left before the first trial, at any pace that is known") {
  const RunForecast waits(plan);
  CHECK(waits.left_s(1, 0s) == Approx(730));
  CHECK(waits.left_s(10, 5s) == Approx(163));
  CHECK_FALSE(waits.left_s(0, 0s));  // as fast as it can: nothing is measured
  CHECK_FALSE(RunForecast().left_s(1, 0s));
  RunForecast begun(plan);
  begun.on_begun(20, 100s);
  CHECK(begun.left_s(1, 130s) == Approx(700));
  CHECK(begun.left_s(1, 1000s) == Approx(670));  // no more than a trial passes unseen
}

TEST_CASE("trials done correct it, and it counts down between them") {
  RunForecast run(plan);
  run.on_begun(20, 0s);
  run.on_trial(1, 140, 1, 120s);  // twice as long as planned
  CHECK(run.left_s(1, 120s) == Approx(9 * 120 + 30 + 90));
  CHECK(run.left_s(1, 180s) == Approx(9 * 120 - 60 + 30 + 90));
  run.on_trial(2, 200, 1, 180s);
  CHECK(run.left_s(1, 180s) == Approx(8 * 90 + 30 + 80));
}

TEST_CASE("another pace counts at once") {
  RunForecast run(plan);
  run.on_begun(0, 0s);
  run.on_trial(1, 60, 60, 1s);
  CHECK(run.left_s(60, 1s) == Approx(9 + 0.5 + 90));
  CHECK(run.left_s(1, 1s) == Approx(540 + 30 + 90));
  CHECK_FALSE(run.left_s(0, 1s));
  run.on_trial(2, 120, 0, 2s);
  CHECK_FALSE(run.left_s(0, 2s));  // the pace changed within that trial
  run.on_trial(3, 180, 0, 3s);
  CHECK(run.left_s(0, 3s) == Approx(7 + 0.5 + 70));
}

TEST_CASE("a bench that does not keep its pace is forecast by what it does") {
  RunForecast run(plan);
  run.on_begun(0, 0s);
  run.on_trial(1, 60, 60, 4s);  // 15 times, not 60
  CHECK(run.left_s(60, 4s) == Approx(540 / 15.0 + 2 + 90));
}

TEST_CASE("no time passes while it is held") {
  RunForecast run(plan);
  run.on_begun(0, 0s);
  run.on_trial(1, 60, 1, 60s);
  run.on_held(true, 70s);
  CHECK(run.left_s(1, 70s) == Approx(650));
  CHECK(run.left_s(1, 5000s) == Approx(650));
  run.on_held(false, 5000s);
  CHECK(run.left_s(1, 5010s) == Approx(640));
}

}  // namespace run_forecast_test
