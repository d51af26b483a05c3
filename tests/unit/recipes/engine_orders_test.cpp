// Pause, stop, abort, halt, faults and guards: any order in any step.

#include <catch2/catch.hpp>

#include "tests/unit/recipes/engine_bench.hpp"

namespace engine_orders_test {

using namespace weft;
using namespace weft::recipes;
using test::Bench;
using test::only;

namespace {

Bench bench() {
  return Bench(test::plan_of(test::small_recipe));
}

Error some_error() {
  return {.code = Errc::device, .where = "stage.z", .what = "broken"};
}

GuardTripped tripped(GuardAction action) {
  return {{Guard::force_cap, action, some_error()}};
}

}  // namespace

TEST_CASE("A stop finishes the repetition first") {
  for (const Step where : {Step::positioning, Step::approaching, Step::resting, Step::holding,
                           Step::sliding, Step::ending, Step::retracting}) {
    Bench b = bench();
    b.advance_to(where);
    b.send(StopRequested{});
    CHECK(b.state.step == where);
    b.finish();
    REQUIRE(b.trials.size() == 1);
    CHECK(b.trials[0].outcome == Outcome::complete);
    CHECK(b.end->outcome == Outcome::stopped);
    CHECK(b.end->rig == RigFact::safe);
  }
}

TEST_CASE("A stop before the cloth is on ends at once") {
  Bench b = bench();
  b.advance_to(Step::mounting);
  b.send(StopRequested{});
  b.finish();
  CHECK(b.trials[0].outcome == Outcome::stopped);
  CHECK(b.end->outcome == Outcome::stopped);
}

TEST_CASE("A stop in the last trial does not spoil a complete campaign") {
  Bench b = bench();
  b.send(Start{3});
  b.advance_to(Step::sliding);
  b.send(StopRequested{});
  b.finish();
  CHECK(b.end->outcome == Outcome::complete);
}

TEST_CASE("A pause holds before the next trial, and resume starts it") {
  Bench b = bench();
  b.advance_to(Step::sliding);
  b.send(PauseRequested{});
  CHECK(b.state.step == Step::sliding);
  b.advance_to(Step::held);
  CHECK(b.trials.at(0).outcome == Outcome::complete);
  CHECK(b.commanded_z_m == Approx(0.092));
  b.send(ResumeRequested{});
  CHECK(only<TrialBegin>(b.effects)->trial == 1);
  CHECK(b.state.step == Step::clearing);
  b.finish();
  CHECK(b.end->outcome == Outcome::complete);
  CHECK(b.trials.size() == b.plan.trials.size());
}

TEST_CASE("A pause at once retracts, and the interrupted trial is repeated") {
  for (const Step where : {Step::clearing, Step::mounting, Step::approaching, Step::pressing,
                           Step::sliding, Step::ending}) {
    Bench b = bench();
    b.advance_to(where);
    b.send(PauseRequested{true});
    CHECK(b.state.step == Step::retracting);
    b.advance_to(Step::held);
    REQUIRE(b.trials.size() == 1);
    CHECK(b.trials[0].outcome == Outcome::stopped);
    b.send(ResumeRequested{});
    CHECK(only<TrialBegin>(b.effects)->trial == 0);
    b.finish();
    CHECK(b.end->outcome == Outcome::complete);
    CHECK(b.trials.size() == b.plan.trials.size() + 1);
  }
}

TEST_CASE("A pause that is taken back before its trial ends changes nothing") {
  Bench b = bench();
  b.advance_to(Step::sliding);
  b.send(PauseRequested{});
  b.send(ResumeRequested{});
  for (const std::size_t before = b.trials.size(); b.trials.size() == before;) b.advance();
  CHECK(b.state.step == Step::mounting);
}

TEST_CASE("While it is held, stop, abort, a fault and a day's patience end the campaign") {
  const auto held = [] {
    Bench b = bench();
    b.advance_to(Step::sliding);
    b.send(PauseRequested{});
    b.advance_to(Step::held);
    return b;
  };
  const auto ends_as = [&](const Event& event, Outcome outcome) {
    Bench b = held();
    b.send(event);
    REQUIRE(b.end);
    CHECK(b.end->outcome == outcome);
    CHECK(b.end->cleanup == Cleanup::done);
  };
  ends_as(StopRequested{}, Outcome::stopped);
  ends_as(AbortRequested{}, Outcome::aborted);
  ends_as(Fault{some_error()}, Outcome::failed);
  const Bench b = held();
  CHECK(b.timer->deadline == b.now + longest_hold);
  ends_as(TimerExpired{b.state.ticket}, Outcome::stopped);
  Bench halted = held();
  halted.send(HaltRequested{});
  CHECK(halted.end->rig == RigFact::holding);
  CHECK(halted.trials.size() == 1);
}

TEST_CASE("An abort from any step stops motion, retracts and ends") {
  for (const Step where :
       {Step::clearing, Step::mounting, Step::positioning, Step::biasing, Step::approaching,
        Step::seating, Step::lowering, Step::resting, Step::pressing, Step::holding, Step::sliding,
        Step::releasing, Step::ending}) {
    Bench b = bench();
    b.advance_to(where);
    b.send(AbortRequested{});
    INFO(to_string(where));
    CHECK(only<StopMotion>(b.effects).has_value());
    CHECK(b.state.step == Step::retracting);
    CHECK(b.phase == Phase::none);
    b.finish();
    CHECK(b.trials.at(0).outcome == Outcome::aborted);
    CHECK(b.end->outcome == Outcome::aborted);
    CHECK(b.end->cleanup == Cleanup::done);
    CHECK(b.commanded_z_m == Approx(0.092));
  }
}

TEST_CASE("A device fault ends the campaign even with on_trial_failure continue") {
  Bench b(test::plan_of(test::small_with(
      "\"repetitions\": 2", "\"repetitions\": 2, \"on_trial_failure\": \"continue\"")));
  b.advance_to(Step::sliding);
  b.send(Fault{some_error()});
  b.finish();
  CHECK(b.trials.size() == 1);
  CHECK(b.end->outcome == Outcome::failed);
  CHECK(b.end->error->what == "broken");
}

TEST_CASE("A guard ends the trial or the campaign according to its action") {
  const Plan plan = test::plan_of(test::small_with(
      "\"repetitions\": 2", "\"repetitions\": 2, \"on_trial_failure\": \"continue\""));
  Bench one(plan);
  one.advance_to(Step::sliding);
  one.send(tripped(GuardAction::fail_trial));
  one.finish();
  CHECK(one.trials.size() == 4);
  Bench all(plan);
  all.advance_to(Step::sliding);
  all.send(tripped(GuardAction::end_campaign));
  all.finish();
  CHECK(all.trials.size() == 1);
}

TEST_CASE("A guard that holds changes nothing, one for the disk lets the trial end first") {
  Bench b = bench();
  b.advance_to(Step::sliding);
  CHECK(b.send(tripped(GuardAction::hold)).empty());
  CHECK(b.state.step == Step::sliding);
  for (int i = 0; i < 3; ++i) CHECK(b.send(tripped(GuardAction::finish_trial)).empty());
  b.finish();
  REQUIRE(b.trials.size() == 1);
  CHECK(b.trials[0].outcome == Outcome::complete);
  CHECK(b.end->outcome == Outcome::stopped);
  CHECK(b.end->error.has_value());
}

TEST_CASE("A guard that keeps tripping does not keep the probe from retreating") {
  Bench b = bench();
  b.advance_to(Step::holding);
  b.send(tripped(GuardAction::fail_trial));
  const Ticket retreat = b.state.ticket;
  for (int i = 0; i < 10; ++i) CHECK(b.send(tripped(GuardAction::fail_trial)).empty());
  CHECK(b.state.ticket == retreat);
  b.finish();
  CHECK(b.end->rig == RigFact::safe);
}

TEST_CASE("A retreat that does not end leaves the rig unknown and reports it") {
  Bench b = bench();
  b.advance_to(Step::holding);
  b.send(AbortRequested{});
  b.send(TimerExpired{b.state.ticket});
  REQUIRE(b.end);
  CHECK(b.end->cleanup == Cleanup::failed);
  CHECK(b.end->rig == RigFact::unknown);
  CHECK(b.trials.at(0).outcome == Outcome::aborted);
}

TEST_CASE(
    "A retreat with a lost stage ends at once: the rig is unknown, and the fault has the reason") {
  Bench b = bench();
  b.advance_to(Step::holding);
  b.send(Fault{some_error()});
  REQUIRE(b.state.step == Step::retracting);
  CHECK(b.send(MotionLost{b.state.ticket - 1}).empty());
  b.send(MotionLost{b.state.ticket});
  REQUIRE(b.end);
  CHECK(only<StopMotion>(b.effects).has_value());
  CHECK(b.end->outcome == Outcome::failed);
  CHECK(b.end->cleanup == Cleanup::failed);
  CHECK(b.end->rig == RigFact::unknown);
  CHECK(b.end->error->what == "broken");
  CHECK(b.trials.at(0).outcome == Outcome::failed);
}

TEST_CASE("A motion that is lost in another step leaves the rest to its fault") {
  for (const Step where :
       {Step::clearing, Step::positioning, Step::lowering, Step::sliding, Step::releasing}) {
    Bench b = bench();
    b.advance_to(where);
    CHECK(b.send(MotionLost{b.state.ticket}).empty());
    CHECK(b.state.step == where);
  }
}

TEST_CASE("A halt ends at once without clean-up") {
  Bench b = bench();
  b.advance_to(Step::sliding);
  b.send(HaltRequested{});
  REQUIRE(b.end);
  CHECK(b.end->cleanup == Cleanup::skipped);
  CHECK(b.end->rig == RigFact::holding);
  CHECK(only<StopMotion>(b.effects).has_value());
  CHECK(b.phase == Phase::none);
}

TEST_CASE("Requests before the start end a campaign that never moved") {
  for (const Event& event : std::vector<Event>{StopRequested{}, AbortRequested{}, HaltRequested{},
                                               Fault{some_error()}}) {
    Bench b = bench();
    b.send(event);
    REQUIRE(b.end);
    CHECK(b.end->cleanup == Cleanup::skipped);
    CHECK(b.end->outcome != Outcome::complete);
    CHECK(b.trials.empty());
  }
}

TEST_CASE("Nothing happens after the end") {
  Bench b = bench();
  b.finish();
  for (const Event& event : std::vector<Event>{Start{}, AbortRequested{}, Fault{some_error()},
                                               MotionDone{b.state.ticket}})
    CHECK(b.send(event).empty());
}

}  // namespace engine_orders_test
