// A rejected attempt: the repetition is repeated as often as the recipe states.

#include <catch2/catch.hpp>

#include "tests/unit/recipes/engine_bench.hpp"

namespace engine_repeat_test {

using namespace weft;
using namespace weft::recipes;
using test::Bench;

namespace {

const Error dead_taxel{.code = Errc::device, .where = "taxel 5", .what = "a taxel is dead"};

Bench bench(std::uint32_t at_most, OnTrialFailure on_failure = OnTrialFailure::stop) {
  Plan plan = test::plan_of(test::small_recipe);
  plan.repeat_bad.emplace().at_most = at_most;
  plan.on_trial_failure = on_failure;
  return Bench(std::move(plan));
}

/// Ends the attempt in progress and rejects it.
void reject(Bench& b) {
  b.advance_to(Step::retracting);
  b.send(AttemptRejected{dead_taxel});
  b.advance();
}

}  // namespace

TEST_CASE("A rejected attempt ends with a retracted probe, and the same repetition is repeated") {
  Bench b = bench(2);
  reject(b);
  REQUIRE(b.trials.size() == 1);
  CHECK(b.trials[0].outcome == Outcome::rejected);
  REQUIRE(b.trials[0].error);
  CHECK(b.trials[0].error->where == "taxel 5");
  CHECK(b.state.trial == 0);
  CHECK(b.state.step == Step::mounting);
  b.finish();
  CHECK(b.trials.size() == b.plan.trials.size() + 1);
  CHECK(b.end->outcome == Outcome::complete);
}

TEST_CASE("A repetition fails after all attempts that the recipe allows are rejected") {
  Bench b = bench(2);
  for (int take = 0; take < 3; ++take) reject(b);
  CHECK(b.trials[1].outcome == Outcome::rejected);
  CHECK(b.trials[2].outcome == Outcome::failed);
  REQUIRE(b.end);
  CHECK(b.end->outcome == Outcome::failed);
  REQUIRE(b.end->error);
  CHECK(b.end->error->code == weft::Errc::measurement);
  CHECK_THAT(b.end->error->what, Catch::Contains(" 3 ") && Catch::EndsWith(": a taxel is dead"));
}

TEST_CASE("Where failed trials are passed over, the next repetition has all its takes again") {
  Bench b = bench(1, OnTrialFailure::carry_on);
  for (int take = 0; take < 2; ++take) reject(b);
  CHECK(b.state.trial == 1);
  reject(b);
  CHECK(b.trials.back().outcome == Outcome::rejected);
  b.finish();
  CHECK(b.end->outcome == Outcome::failed);
}

TEST_CASE("Takes that were rejected before the machine went on count") {
  Bench b = bench(2);
  b.send(Start{1, 2});
  reject(b);
  CHECK(b.trials[0].trial == 1);
  CHECK(b.trials[0].outcome == Outcome::failed);
}

TEST_CASE("Orders received meanwhile are carried out before the next attempt") {
  Bench stopped = bench(2);
  stopped.advance_to(Step::sliding);
  stopped.send(StopRequested{});
  reject(stopped);
  CHECK(stopped.end->outcome == Outcome::stopped);
  Bench held = bench(2);
  held.advance_to(Step::sliding);
  held.send(PauseRequested{});
  reject(held);
  CHECK(held.state.step == Step::held);
  held.advance();
  CHECK(held.state.trial == 0);
}

TEST_CASE("An interrupted trial keeps its outcome, and without repeat_bad none is rejected") {
  Bench cut = bench(2);
  cut.advance_to(Step::ending);
  cut.send(AbortRequested{});
  reject(cut);
  CHECK(cut.trials[0].outcome == Outcome::aborted);
  Bench never(test::plan_of(test::small_recipe));
  reject(never);
  CHECK(never.trials[0].outcome == Outcome::complete);
}

}  // namespace engine_repeat_test
