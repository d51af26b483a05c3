// The final steps of a recipe: their time, their budget, and the reasons for their end.

#include <catch2/catch.hpp>

#include "tests/unit/recipes/engine_bench.hpp"

namespace finally_test {

using namespace weft;
using namespace weft::recipes;
using test::Bench;

namespace {

const Error broken{.code = Errc::device, .where = "stage.x", .what = "broken"};

Bench bench(const std::string& finally) {
  return Bench(
      test::plan_of(test::small_with("\"repetitions\": 2", "\"repetitions\": 2, " + finally)));
}

Bench parking() {
  return bench(R"("finally": {
    "on_success": [{"do": "park", "x_mm": 5, "y_mm": 7}, {"do": "wait", "duration_s": 4}],
    "on_stop": [{"do": "park", "x_mm": 9, "y_mm": 9}],
    "on_fault": [{"do": "wait", "duration_s": 30}], "budget_s": 60})");
}

/// Lets the wait in progress expire.
void wait_out(Bench& b) {
  b.now = b.timer->deadline;
  b.send(TimerExpired{b.state.ticket});
}

}  // namespace

TEST_CASE("After the last trial the stages park, then wait, and the campaign is complete") {
  Bench b = parking();
  b.advance_to(Step::concluding);
  CHECK(b.trials.size() == b.plan.trials.size());
  CHECK(b.commanded_z_m == b.plan.limits.clear_z_m());
  const auto park = test::only<MoveTo>(b.effects);
  REQUIRE(park);
  REQUIRE(park->moves.size() == 2);
  CHECK(park->moves[0].axis == Axis::x);
  CHECK(park->moves[0].target == 0.005);
  CHECK(park->moves[1].target == 0.007);
  b.send(MotionDone{park->ticket});
  CHECK(b.state.step == Step::concluding);
  CHECK(b.timer->deadline == b.now + std::chrono::seconds(4));
  wait_out(b);
  REQUIRE(b.end);
  CHECK(b.end->outcome == Outcome::complete);
  CHECK(b.end->cleanup == Cleanup::done);
  CHECK(b.end->rig == RigFact::safe);
  CHECK_FALSE(b.end->error);
}

TEST_CASE("The forecast has the parks and waits that follow a complete campaign") {
  const Forecast without = test::plan_of(test::small_recipe).forecast;
  CHECK(without.finally_s == 0);
  const Forecast with = parking().plan.forecast;
  // Both paths end 50 mm beyond (50, 50): 95 mm at 4 mm/s, a ramp of 0.2 s, the confirmation.
  CHECK(with.finally_s == Approx(95 / 4.0 + 0.2 + 0.1 + 4));
  CHECK(with.duration_s == Approx(without.duration_s + with.finally_s));
  CHECK(with.trials_s() == Approx(without.duration_s));
  CHECK(with.bytes == without.bytes);
  CHECK(with.envelope[index(Axis::x)].min == Approx(0.005));
  CHECK(with.margin[index(Axis::y)] == Approx(0.007));
  const Forecast cut =
      bench(R"("finally": {"on_success": [{"do": "wait", "duration_s": 90}], "budget_s": 60})")
          .plan.forecast;
  CHECK(cut.finally_s == 60);
}

TEST_CASE("A stop, an abort and a fault each have what is done after them") {
  Bench stopped = parking();
  stopped.advance_to(Step::sliding);
  stopped.send(StopRequested{});
  stopped.advance_to(Step::concluding);
  CHECK(test::only<MoveTo>(stopped.effects)->moves[0].target == 0.009);
  stopped.finish();
  CHECK(stopped.end->outcome == Outcome::stopped);
  Bench aborted = parking();
  aborted.advance_to(Step::sliding);
  aborted.send(AbortRequested{});
  aborted.advance_to(Step::concluding);
  aborted.finish();
  CHECK(aborted.end->outcome == Outcome::aborted);
  Bench failed = parking();
  failed.advance_to(Step::sliding);
  failed.send(Fault{broken});
  failed.advance_to(Step::concluding);
  CHECK(test::all_of<MoveTo>(failed.effects).empty());
  wait_out(failed);
  CHECK(failed.end->outcome == Outcome::failed);
  CHECK(failed.end->cleanup == Cleanup::done);
}

TEST_CASE("Without a probe known to be up there are no final steps") {
  Bench halted = parking();
  halted.advance_to(Step::sliding);
  halted.send(HaltRequested{});
  REQUIRE(halted.end);
  CHECK(halted.end->cleanup == Cleanup::skipped);
  Bench stuck = parking();
  stuck.advance_to(Step::retracting);
  wait_out(stuck);
  REQUIRE(stuck.end);
  CHECK(stuck.end->cleanup == Cleanup::failed);
  CHECK(stuck.end->rig == RigFact::unknown);
}

TEST_CASE("Where a campaign ends in a pause or while a person is at work nothing moves any more") {
  Bench held = parking();
  held.advance_to(Step::sliding);
  held.send(PauseRequested{});
  held.advance_to(Step::held);
  held.send(StopRequested{});
  Bench prompts =
      bench(R"("operator_steps": [{"before": "fabric", "text": "Mount {fabric}.", "people_s": 9}],
    "finally": {"on_stop": [{"do": "park", "x_mm": 9, "y_mm": 9}]})");
  prompts.advance_to(Step::awaiting_operator);
  prompts.send(AbortRequested{});
  for (const Bench& b : {held, prompts}) {
    REQUIRE(b.end);
    CHECK(test::all_of<MoveTo>(b.effects).empty());
    CHECK(b.end->cleanup == Cleanup::partial);
    CHECK(b.end->rig == RigFact::safe);
  }
}

TEST_CASE(
    "An order during the final steps ends them and does not change the outcome of the trials") {
  const auto concluding = [] {
    Bench b = parking();
    b.advance_to(Step::concluding);
    return b;
  };
  Bench faulty = concluding();
  faulty.send(Fault{broken});
  REQUIRE(faulty.end);
  CHECK(test::only<StopMotion>(faulty.effects));
  CHECK(faulty.end->outcome == Outcome::complete);
  CHECK(faulty.end->cleanup == Cleanup::partial);
  CHECK(faulty.end->rig == RigFact::unknown);
  CHECK(faulty.end->error->where == "stage.x");
  Bench aborted = concluding();
  aborted.send(AbortRequested{});
  REQUIRE(aborted.end);
  CHECK(aborted.end->outcome == Outcome::complete);
  CHECK(aborted.end->cleanup == Cleanup::partial);
  CHECK(aborted.end->rig == RigFact::safe);
  Bench halted = concluding();
  halted.send(HaltRequested{});
  REQUIRE(halted.end);
  CHECK(halted.end->outcome == Outcome::complete);
  CHECK(halted.end->cleanup == Cleanup::skipped);
  CHECK(halted.end->rig == RigFact::holding);
  Bench paused = concluding();
  paused.send(PauseRequested{true});
  CHECK(paused.state.step == Step::concluding);
  Bench silent = concluding();
  wait_out(silent);  // the park gets no answer
  REQUIRE(silent.end);
  CHECK(silent.end->cleanup == Cleanup::partial);
  CHECK(silent.end->error);
}

TEST_CASE("The budget is for all of it: what is not done by then is left out, with a sentence") {
  Bench b = bench(R"("finally": {"on_success": [{"do": "wait", "duration_s": 40},
    {"do": "wait", "duration_s": 40}, {"do": "park", "x_mm": 5, "y_mm": 5}], "budget_s": 60})");
  b.advance_to(Step::concluding);
  const TimePoint began = b.now;
  wait_out(b);
  CHECK(b.state.step == Step::concluding);
  wait_out(b);
  CHECK(b.now == began + std::chrono::seconds(60));
  REQUIRE(b.end);
  CHECK(b.end->cleanup == Cleanup::partial);
  CHECK(b.end->outcome == Outcome::complete);
  CHECK(b.end->error->hint.find("finally.budget_s") != std::string::npos);
}

TEST_CASE("A place that the stages do not reach is refused before anything moves") {
  const CheckReport report = check_recipe(
      test::small_with(
          "\"repetitions\": 2",
          R"("repetitions": 2, "finally": {"on_stop": [{"do": "park", "x_mm": 9999, "y_mm": 5}]})"),
      test::limits());
  REQUIRE_FALSE(report.plan);
  REQUIRE(report.problems.size() == 1);
  CHECK(report.problems[0].pointer == "/finally/on_stop/0/x_mm");
}

TEST_CASE("The checker warns of waits that their budget leaves no time for") {
  const auto about_budget = [](const std::string& finally) {
    const CheckReport report = check_recipe(
        test::small_with("\"repetitions\": 2", "\"repetitions\": 2, \"finally\": " + finally),
        test::limits());
    REQUIRE(report.plan);
    std::string out;
    for (const Diagnostic& one : report.warnings)
      if (one.pointer.starts_with("/finally")) out += to_string(one) + "\n";
    return out;
  };
  CHECK(about_budget(R"({"on_success": [{"do": "wait", "duration_s": 30}], "budget_s": 31})") ==
        "");
  const std::string longer =
      about_budget(R"({"on_success": [{"do": "wait", "duration_s": 3600}], "budget_s": 1})");
  CHECK(longer.starts_with("/finally/on_success: "));
  CHECK_THAT(longer, Catch::Contains("budget_s"));
  // A wait as long as the budget is too long: then the budget ends it.
  const std::string two = about_budget(
      R"({"on_stop": [{"do": "wait", "duration_s": 20}],
          "on_fault": [{"do": "wait", "duration_s": 200}, {"do": "park", "x_mm": 5, "y_mm": 7},
                       {"do": "wait", "duration_s": 100}]})");
  CHECK(two.starts_with("/finally/on_fault: "));
  CHECK(std::ranges::count(two, '\n') == 1);
}

}  // namespace finally_test
