#include <catch2/catch.hpp>

#include "tests/unit/recipes/engine_bench.hpp"

using namespace weft;
using namespace weft::recipes;
using test::all_of;
using test::Bench;
using test::only;

namespace {

Bench bench() {
  return Bench(test::plan_of(test::small_recipe));
}

Error some_error() {
  return {Errc::device, "broken", "stage.z", "", "", ""};
}

GuardTripped tripped(GuardAction action) {
  return {{Guard::force_cap, action, some_error()}};
}

}  // namespace

TEST_CASE("A trial goes through its steps in the documented order") {
  Bench b = bench();
  std::vector<Step> steps;
  for (b.advance(); b.trials.empty(); b.advance()) steps.push_back(b.state.step);
  const std::vector<Step> expected{
      Step::clearing, Step::mounting, Step::positioning, Step::biasing,  Step::approaching,
      Step::seating,  Step::lowering, Step::resting,     Step::pressing, Step::holding,
      Step::sliding,  Step::sliding,  Step::releasing,   Step::ending,   Step::retracting};
  CHECK(steps == expected);
}

TEST_CASE("Phases are recorded in the order S, P, M, E and nothing else is") {
  Bench b = bench();
  std::string phases;
  b.advance();
  while (b.trials.empty()) {
    for (const SetPhase& e : all_of<SetPhase>(b.effects)) phases += to_char(e.phase);
    b.advance();
  }
  CHECK(phases == "S-PM-E-");
}

TEST_CASE("The mounted cloth carries the trial's patch") {
  Bench b = bench();
  b.advance_to(Step::mounting);
  const auto mount = only<MountFabric>(b.effects);
  REQUIRE(mount);
  CHECK(mount->fabric == "denim");
  CHECK(mount->patch_seed == patch_seed(1, "denim", "M2", 1));
}

TEST_CASE("Nothing moves across the cloth before the probe is clear of it") {
  Bench b = bench();
  b.advance();
  const auto up = only<MoveTo>(b.effects);
  REQUIRE(up);
  REQUIRE(up->moves.size() == 1);
  CHECK(up->moves[0].axis == Axis::z);
  CHECK(up->moves[0].target == Approx(0.092));  // 100 mm surface less 8 mm clearance
}

TEST_CASE("The approach stops at first contact, then goes on slowly to the probe's weight") {
  Bench b = bench();
  b.advance_to(Step::approaching);
  const auto fast = only<Descend>(b.effects);
  REQUIRE(fast);
  CHECK(fast->stop_force_n == 0.1);
  CHECK(fast->target_z_m == Approx(0.101));
  b.advance();
  const auto slow = only<Descend>(b.effects);
  REQUIRE(slow);
  CHECK(slow->speed_mps < fast->speed_mps);
  CHECK(slow->stop_force_n == Approx(0.9 * 0.2 * 9.80665));
}

TEST_CASE("The rest position is the touch plus the rest travel, and E returns to it") {
  Bench b = bench();
  b.touch_z_m = 0.0981;
  b.advance_to(Step::lowering);
  CHECK(b.commanded_z_m == Approx(0.0986));
  b.advance_to(Step::releasing);
  CHECK(only<ReleaseForce>(b.effects).has_value());
  CHECK(b.commanded_z_m == Approx(0.0986));
}

TEST_CASE("The slide follows the path in stage coordinates at the wanted speed") {
  Bench b = bench();
  b.advance_to(Step::sliding);
  const auto along_weft = only<MoveTo>(b.effects);
  REQUIRE(along_weft);
  REQUIRE(along_weft->moves.size() == 1);
  CHECK(along_weft->moves[0].axis == Axis::y);
  CHECK(along_weft->moves[0].target == Approx(0.1));
  CHECK(along_weft->moves[0].speed == Approx(0.002));
  b.advance();
  const auto along_warp = only<MoveTo>(b.effects);
  REQUIRE(along_warp);
  CHECK(along_warp->moves[0].axis == Axis::x);
  CHECK(b.force_loop);
}

TEST_CASE("A diagonal leg shares its speed between the axes") {
  const std::string recipe =
      test::small_with("\"dx_mm\": 0, \"dy_mm\": 50", "\"dx_mm\": 30, \"dy_mm\": 40");
  Bench b(test::plan_of(recipe));
  b.advance_to(Step::sliding);
  const auto move = only<MoveTo>(b.effects);
  REQUIRE(move);
  REQUIRE(move->moves.size() == 2);
  CHECK(move->moves[0].speed == Approx(0.0012));
  CHECK(move->moves[1].speed == Approx(0.0016));
}

TEST_CASE("A campaign completes with every trial and a safe rig") {
  Bench b = bench();
  b.finish();
  CHECK(b.trials.size() == 4);
  REQUIRE(b.end);
  CHECK(b.end->outcome == Outcome::complete);
  CHECK(b.end->cleanup == Cleanup::done);
  CHECK(b.end->rig == RigFact::safe);
  CHECK(b.state.completed == 4);
}

TEST_CASE("A campaign can go on from a later trial") {
  Bench b = bench();
  b.send(Start{3});
  CHECK(only<TrialBegin>(b.effects)->trial == 3);
  b.finish();
  CHECK(b.trials.size() == 1);
  Bench past = bench();
  past.send(Start{4});
  CHECK(past.end->outcome == Outcome::complete);
}

TEST_CASE("Recorded phases last as long as the recipe says") {
  Bench b = bench();
  b.now = TimePoint(std::chrono::seconds(100));
  b.advance_to(Step::resting);
  CHECK(b.timer->deadline == b.now + std::chrono::seconds(3));
  b.advance_to(Step::holding);
  CHECK(b.timer->deadline == b.now + std::chrono::seconds(6));
}

TEST_CASE("Answers with an old ticket change nothing") {
  Bench b = bench();
  b.advance_to(Step::approaching);
  const State before = b.state;
  const Ticket old = before.ticket - 1;
  for (const Event& event :
       std::vector<Event>{MotionDone{old}, ContactFound{old, 0.09}, TimerExpired{old}, Biased{old},
                          Mounted{old}, ForceSettled{old}, Start{}}) {
    CHECK(b.send(event).empty());
    CHECK(b.state.step == before.step);
    CHECK(b.state.ticket == before.ticket);
  }
}

TEST_CASE("A timer that expires fails the trial, and the campaign stops by default") {
  for (const Step where :
       {Step::clearing, Step::mounting, Step::positioning, Step::biasing, Step::approaching,
        Step::seating, Step::lowering, Step::pressing, Step::sliding, Step::releasing}) {
    Bench b = bench();
    b.advance_to(where);
    b.send(TimerExpired{b.state.ticket});
    INFO(to_string(where));
    CHECK(b.state.step == Step::retracting);
    CHECK(b.phase == Phase::none);
    CHECK_FALSE(b.force_loop);
    b.finish();
    REQUIRE(b.trials.size() == 1);
    CHECK(b.trials[0].outcome == Outcome::failed);
    REQUIRE(b.trials[0].error);
    CHECK(b.trials[0].error->code == Errc::timeout);
    CHECK_THAT(to_string(*b.trials[0].error), Catch::Contains("denim, M2, repetition 1"));
    CHECK(b.end->outcome == Outcome::failed);
    CHECK(b.end->rig == RigFact::safe);
  }
}

TEST_CASE("With on_trial_failure continue the campaign goes on and says what failed") {
  Bench b(test::plan_of(test::small_with(
      "\"repetitions\": 2", "\"repetitions\": 2, \"on_trial_failure\": \"continue\"")));
  b.advance_to(Step::pressing);
  b.send(TimerExpired{b.state.ticket});
  b.finish();
  CHECK(b.trials.size() == 4);
  CHECK(b.state.completed == 3);
  CHECK(b.end->outcome == Outcome::failed);
  CHECK(b.end->error->code == Errc::timeout);
}

TEST_CASE("An approach that meets nothing fails the trial") {
  Bench b = bench();
  b.advance_to(Step::approaching);
  b.send(MotionDone{b.state.ticket});
  b.finish();
  CHECK_THAT(b.trials[0].error->message, Catch::Contains("without bearing on the cloth"));
}

TEST_CASE("A touch outside the travel, or not a number, fails the trial") {
  for (const double z : {0.1499, -1.0, std::nan("")}) {
    Bench b = bench();
    b.touch_z_m = z;
    b.advance_to(Step::retracting);
    b.finish();
    CHECK(b.trials[0].error->code == Errc::range);
  }
}

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

TEST_CASE("A pause holds before the next trial, and resuming goes on with it") {
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

TEST_CASE("A pause at once retracts, and the trial that it cut short is run again") {
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
  CHECK(b.end->error->message == "broken");
}

TEST_CASE("A guard ends as much as its action says") {
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

TEST_CASE("A retreat that does not end leaves the rig unknown, and says so") {
  Bench b = bench();
  b.advance_to(Step::holding);
  b.send(AbortRequested{});
  b.send(TimerExpired{b.state.ticket});
  REQUIRE(b.end);
  CHECK(b.end->cleanup == Cleanup::failed);
  CHECK(b.end->rig == RigFact::unknown);
  CHECK(b.trials.at(0).outcome == Outcome::aborted);
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
