// Random event sequences: for any events in any order the machine keeps its invariants.

#include <catch2/catch.hpp>
#include <random>

#include "tests/unit/recipes/engine_bench.hpp"

namespace engine_property_test {

using namespace weft;
using namespace weft::recipes;
using test::Bench;

namespace {

Error some_error() {
  return {.code = Errc::device, .where = "stage.z", .what = "broken"};
}

/// Mostly good answers, else any event with a ticket near the present one.
Event random_event(const Bench& bench, std::mt19937& random) {
  const auto draw = [&](unsigned n) { return static_cast<unsigned>(random() % n); };
  if (draw(100) < 70) return bench.good_answer();
  const Ticket ticket = bench.state.ticket - draw(3);
  switch (draw(60)) {
    case 0:
      return Fault{some_error()};
    case 1:
      return GuardTripped{{Guard::force_cap, GuardAction::fail_trial, some_error()}};
    case 2:
      return GuardTripped{{Guard::travel, GuardAction::end_campaign, some_error()}};
    case 3:
      return StopRequested{};
    case 4:
      return AbortRequested{};
    case 5:
      return HaltRequested{};
    case 6:
      return Start{draw(8)};
    case 7:
      return ForceReached{ticket, draw(2) == 0 ? 0.0985 : 1e308};
    case 8:
      return PauseRequested{draw(2) == 0};
    case 9:
      return ResumeRequested{};
    case 10:
    case 11:
      return AttemptRejected{some_error()};
    case 12:
    case 13:
      return MotionLost{ticket};
    case 14:
      return RestMeasured{draw(2) == 0 ? Phase::rest : Phase::end, draw(2) == 0 ? 1.96 : 5.87, 0};
    case 15:
    case 16:
    case 17:
      return EndSlide{};
    default:
      break;
  }
  switch (draw(7)) {
    case 6:
      return OperatorConfirmed{ticket};
    case 0:
      return Mounted{ticket};
    case 1:
      return Biased{ticket};
    case 2:
      return MotionDone{ticket};
    case 3:
      return ForceSettled{ticket};
    case 4:
      return ForceReached{ticket, 0.0985};
    default:
      return TimerExpired{ticket};
  }
}

/// The first violated invariant, or null. Called a few million times, so Catch gets only
/// violations.
const char* broken_promise(const Bench& b) {
  const bool recording = b.state.step == Step::resting || b.state.step == Step::holding ||
                         b.state.step == Step::sliding || b.state.step == Step::ending;
  if ((b.phase != Phase::none) != recording) return "samples belong to a recorded step";
  const bool regulated = b.state.step == Step::pressing || b.state.step == Step::holding ||
                         b.state.step == Step::sliding;
  if (b.force_loop != (regulated && b.press_force_n() != 0))
    return "the force loop is on while the force is held";
  const bool has_moved = b.commanded_z_m != 0;
  if (b.state.step == Step::awaiting_operator && has_moved &&
      b.commanded_z_m != b.plan.limits.clear_z_m())
    return "the probe is up while a person is at work";
  if (b.state.step == Step::ready || b.state.step == Step::done) return nullptr;
  if (!b.timer || b.timer->ticket != b.state.ticket) return "every step has its timer";
  return b.timer->deadline > b.now - std::chrono::hours(1) ? nullptr : "a timer lies ahead";
}

/// Whether the rig may be left as it is because of this event: a device or a guard reported a
/// fault, the stage of the retract is lost, the halt was pressed, no answer came while the engine
/// waited for more than time, or it ended before any motion and is as it was found.
bool excuses(const Bench& b, const Event& event) {
  if (b.state.step == Step::ready &&
      (std::holds_alternative<AbortRequested>(event) ||
       std::holds_alternative<StopRequested>(event) || std::holds_alternative<GuardTripped>(event)))
    return true;
  if (const auto* guard = std::get_if<GuardTripped>(&event))
    return guard->trip.action == GuardAction::end_campaign;
  if (std::holds_alternative<TimerExpired>(event))
    return !std::holds_alternative<TimerExpired>(b.good_answer());
  if (std::holds_alternative<MotionLost>(event)) return b.state.step == Step::retracting;
  return std::holds_alternative<Fault>(event) || std::holds_alternative<HaltRequested>(event);
}

/// One campaign of random events to its end. Returns whether an event excused an unsafe rig.
bool play(Bench& b, std::mt19937& random) {
  bool excused = false;
  for (int events = 0; b.state.step != Step::done; ++events) {
    if (events == 2000) FAIL("it does not end");
    b.now += std::chrono::milliseconds(random() % 500);
    const Event event = random_event(b, random);
    excused = excused || excuses(b, event);
    b.send(event);
    if (const char* broken = broken_promise(b)) FAIL(broken);
  }
  return excused;
}

const char* const parking = R"("repetitions": 2, "finally": {
    "on_success": [{"do": "park", "x_mm": 5, "y_mm": 5}, {"do": "wait", "duration_s": 1}],
    "on_stop": [{"do": "wait", "duration_s": 2}], "on_fault": [{"do": "park", "x_mm": 5, "y_mm": 5}],
    "budget_s": 20})";

const char* const asking = R"("repetitions": 2, "operator_steps": [
    {"before": "campaign", "text": "Clean the probe.", "people_s": 30},
    {"before": "fabric", "text": "Mount {fabric}.", "people_s": 90}])";

}  // namespace

TEST_CASE("Any of 100 000 sequences of events ends, retracted unless the end reports otherwise") {
  const Plan plain = test::plan_of(test::small_recipe);
  const Plan prompts = test::plan_of(test::small_with("\"repetitions\": 2", asking));
  const Plan parks = test::plan_of(test::small_with("\"repetitions\": 2", parking));
  const Plan light = test::plan_of(test::small_with("\"force_N\": 5", "\"force_N\": 1"));
  const Plan hovers = test::plan_of(test::small_with("\"force_N\": 5", "\"force_N\": 0"));
  std::mt19937 random(20260101);
  int safe = 0, unsafe = 0, complete = 0, ended_early = 0, partly = 0;
  for (int run = 0; run < 100'000; ++run) {
    const Plan* const plans[]{&prompts, &parks, &plain, &light, &parks, &hovers};
    Bench b(*plans[run % std::size(plans)]);
    b.plan.on_trial_failure = run % 2 == 0 ? OnTrialFailure::stop : OnTrialFailure::carry_on;
    b.plan.repeat_bad.emplace().at_most = 2;
    const bool can_end_early = run % 5 < 3;
    for (Exploration& exploration : b.plan.explorations)
      exploration.live_vote =
          LiveVote{"m.live", can_end_early ? std::optional(StopEarly{0.9, 1}) : std::nullopt};
    const bool excused = play(b, random);
    if (!b.end) FAIL("no end was reported");
    const bool up = b.commanded_z_m == b.plan.limits.clear_z_m();
    const bool is_safe = b.end->rig == RigFact::safe && !b.trials.empty();
    if (is_safe && !up) FAIL("safe, and the probe is not up");
    if (b.end->rig != RigFact::safe && !excused) FAIL("not safe, and nothing was wrong");
    unsafe += b.end->rig != RigFact::safe ? 1 : 0;
    for (const TrialDone& trial : b.trials) {
      if (!trial.ended_early) continue;
      ++ended_early;
      if (!can_end_early) FAIL("a slide ended early without stop_early");
      if (trial.outcome != Outcome::complete) FAIL("ended early, and not complete");
    }
    safe += is_safe ? 1 : 0;
    complete += b.end->outcome == Outcome::complete ? 1 : 0;
    partly += b.end->cleanup == Cleanup::partial ? 1 : 0;
    if (b.end->outcome == Outcome::complete && b.state.failed > 0) FAIL("not every trial is");
  }
  CHECK(safe > 50'000);
  CHECK(unsafe > 1000);
  CHECK(complete > 1000);
  CHECK(ended_early > 1000);
  CHECK(partly > 1000);
}

TEST_CASE("Without any answer, timers alone end the campaign") {
  Plan plan = test::plan_of(test::small_recipe);
  for (int start = 0; start < 40; ++start) {
    Bench b(plan);
    for (int i = 0; i < start && b.state.step != Step::done; ++i) b.advance();
    if (b.state.step == Step::ready) b.send(Start{});
    for (int i = 0; i < 10 && b.state.step != Step::done; ++i) {
      b.now = b.timer->deadline;
      b.send(TimerExpired{b.state.ticket});
    }
    CHECK(b.state.step == Step::done);
  }
}

TEST_CASE("Every trial that begins ends exactly once") {
  Plan plan = test::plan_of(test::small_recipe);
  plan.on_trial_failure = OnTrialFailure::carry_on;
  std::mt19937 random(7);
  for (int run = 0; run < 500; ++run) {
    Bench b(plan);
    std::size_t begun = 0;
    while (b.state.step != Step::done) {
      b.send(random_event(b, random));
      begun += test::all_of<TrialBegin>(b.effects).size();
    }
    REQUIRE(begun == b.trials.size());
  }
}

}  // namespace engine_property_test
