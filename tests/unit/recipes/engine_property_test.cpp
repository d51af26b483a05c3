// Random event sequences: whatever comes in whatever order, the machine keeps its promises.

#include <catch2/catch.hpp>
#include <random>

#include "tests/unit/recipes/engine_bench.hpp"

using namespace weft;
using namespace weft::recipes;
using test::Bench;

namespace {

Error some_error() {
  return {Errc::device, "broken", "stage.z", "", "", ""};
}

/// Mostly good answers, else anything with a ticket around the present one.
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
      return ContactFound{ticket, draw(2) == 0 ? 0.0985 : 1e308};
    case 8:
      return PauseRequested{draw(2) == 0};
    case 9:
      return ResumeRequested{};
    case 10:
    case 11:
      return TakeRejected{some_error()};
    default:
      break;
  }
  switch (draw(6)) {
    case 0:
      return Mounted{ticket};
    case 1:
      return Biased{ticket};
    case 2:
      return MotionDone{ticket};
    case 3:
      return ForceSettled{ticket};
    case 4:
      return ContactFound{ticket, 0.0985};
    default:
      return TimerExpired{ticket};
  }
}

void check_promises(const Bench& b) {
  const bool recording = b.state.step == Step::resting || b.state.step == Step::holding ||
                         b.state.step == Step::sliding || b.state.step == Step::ending;
  REQUIRE((b.phase != Phase::none) == recording);
  const bool regulated = b.state.step == Step::pressing || b.state.step == Step::holding ||
                         b.state.step == Step::sliding;
  REQUIRE(b.force_loop == regulated);
  if (b.state.step != Step::ready && b.state.step != Step::done) {
    REQUIRE(b.timer);
    REQUIRE(b.timer->ticket == b.state.ticket);
    REQUIRE(b.timer->deadline > b.now - std::chrono::hours(1));
  }
}

}  // namespace

TEST_CASE("Any sequence of events ends, and the rig is retracted unless it says otherwise") {
  Plan plan = test::plan_of(test::small_recipe);
  std::mt19937 random(20260101);
  int safe = 0;
  for (int run = 0; run < 4000; ++run) {
    plan.on_trial_failure = run % 2 == 0 ? OnTrialFailure::stop : OnTrialFailure::carry_on;
    plan.repeat_bad.emplace().at_most = 2;
    Bench b(plan);
    int events = 0;
    for (; b.state.step != Step::done; ++events) {
      REQUIRE(events < 2000);
      b.now += std::chrono::milliseconds(random() % 500);
      b.send(random_event(b, random));
      check_promises(b);
    }
    REQUIRE(b.end);
    if (b.end->rig == RigFact::safe && !b.trials.empty()) {
      ++safe;
      REQUIRE(b.commanded_z_m == Approx(plan.limits.clear_z_m()));
    }
    if (b.end->outcome == Outcome::complete) REQUIRE(b.state.failed == 0);
  }
  CHECK(safe > 2000);
}

TEST_CASE("When nobody answers, timers alone bring the campaign to its end") {
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
