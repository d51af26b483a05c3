#include <catch2/catch.hpp>
#include <cmath>

#include "recipes/engine/motion.hpp"
#include "tests/unit/recipes/engine_bench.hpp"

namespace engine_test {

using namespace weft;
using namespace weft::recipes;
using test::all_of;
using test::Bench;
using test::only;

namespace {

constexpr double weight_n = 0.2 * 9.80665;

Bench bench() {
  return Bench(test::plan_of(test::small_recipe));
}

Bench bench_holding(double force_n) {
  return Bench(
      test::plan_of(test::small_with("\"force_N\": 5", "\"force_N\": " + std::to_string(force_n))));
}

}  // namespace

TEST_CASE("A trial goes through its steps in the documented order") {
  Bench b = bench();
  std::vector<Step> steps;
  for (b.advance(); b.trials.empty(); b.advance()) steps.push_back(b.state.step);
  const std::vector<Step> expected{
      Step::clearing,    Step::mounting,  Step::positioning, Step::biasing,
      Step::approaching, Step::seating,   Step::lowering,    Step::resting,
      Step::pressing,    Step::holding,   Step::sliding,     Step::sliding,
      Step::releasing,   Step::unloading, Step::ending,      Step::retracting};
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
  CHECK(mount->seeds.touch == patch_seed(1, "denim", "M2", 1));
}

TEST_CASE("Nothing moves across the cloth before the probe is clear of it") {
  Bench b = bench();
  b.advance();
  const auto up = only<MoveTo>(b.effects);
  REQUIRE(up);
  REQUIRE(up->moves.size() == 1);
  CHECK(up->moves[0].axis == Axis::z);
  CHECK(up->moves[0].target == Approx(0.092));  // 100 mm surface minus 8 mm clearance
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

TEST_CASE("S rests by the rest travel under the touch, E over where the force has fallen") {
  Bench b = bench();
  b.touch_z_m = 0.0981;
  b.released_z_m = 0.0995;
  b.advance_to(Step::lowering);
  CHECK(b.commanded_z_m == Approx(0.0986));
  b.advance_to(Step::releasing);
  CHECK(only<ReleaseForce>(b.effects).has_value());
  const auto up = only<Ascend>(b.effects);
  REQUIRE(up);
  CHECK(up->stop_force_n == Approx(1.1 * weight_n));
  CHECK(up->target_z_m == b.plan.limits.clear_z_m());
  b.advance();
  CHECK(b.state.step == Step::unloading);
  CHECK(b.commanded_z_m == Approx(0.0990));
}

TEST_CASE("A set point below the weight is reached slowly from above, and left downwards") {
  Bench b = bench_holding(1);
  b.advance_to(Step::lifting);
  CHECK_FALSE(b.force_loop);
  const auto up = only<Ascend>(b.effects);
  REQUIRE(up);
  CHECK(up->stop_force_n == Approx(0.9 * weight_n));
  CHECK(up->speed_mps <= 0.1e-3);  // the stop is stiff
  b.advance();
  CHECK(only<HoldForce>(b.effects)->force_n == 1);
  b.advance_to(Step::releasing);
  const auto down = only<Descend>(b.effects);
  REQUIRE(down);
  CHECK(down->stop_force_n == Approx(0.9 * weight_n));
  b.advance();
  CHECK(b.commanded_z_m == Approx(b.released_z_m + b.plan.limits.rest_travel_m));
}

TEST_CASE("A probe held at about its weight is first lowered to the upper end of its slack") {
  Bench b = bench_holding(2);
  b.advance_to(Step::releasing);
  const auto down = only<Descend>(b.effects);
  REQUIRE(down);
  CHECK(down->stop_force_n > weight_n);
  b.advance();
  CHECK(b.commanded_z_m == Approx(b.released_z_m - b.plan.limits.rest_travel_m));
}

TEST_CASE("A set point of nothing is a stroke above the cloth") {
  Bench b = bench_holding(0);
  b.advance_to(Step::lifting);
  CHECK(b.commanded_z_m == b.plan.limits.clear_z_m());
  b.advance();
  CHECK(b.phase == Phase::press);
  CHECK_FALSE(b.force_loop);
  b.advance_to(Step::releasing);
  CHECK(only<Descend>(b.effects)->stop_force_n == Approx(0.9 * weight_n));
  b.finish();
  CHECK(b.end->outcome == Outcome::complete);
}

TEST_CASE("A force that never falls ends the way up at the clear height, and the trial") {
  Bench b = bench();
  b.advance_to(Step::releasing);
  b.send(MotionDone{b.state.ticket});
  b.finish();
  CHECK(b.trials[0].error->code == Errc::measurement);
}

TEST_CASE("A probe that does not rest by its weight fails the trial, in S and in E") {
  struct Row {
    Step when;
    RestMeasured measured;
    Outcome outcome;
  };
  for (const Row& row :
       {Row{Step::pressing, {Phase::rest, 5.87, 0.001}, Outcome::failed},
        Row{Step::pressing, {Phase::rest, 0.97 * weight_n, 0.001}, Outcome::complete},
        Row{Step::pressing, {Phase::rest, 1.2 * weight_n, 0.15}, Outcome::complete},
        Row{Step::retracting, {Phase::end, 1.57, 0.001}, Outcome::failed},
        Row{Step::retracting, {Phase::end, 1.04 * weight_n, 0.001}, Outcome::complete}}) {
    CAPTURE(to_string(row.when), row.measured.mean_n);
    Bench b = bench();
    b.advance_to(row.when);
    b.send(row.measured);
    CHECK(b.state.step == (row.outcome == Outcome::failed ? Step::retracting : row.when));
    while (b.trials.empty()) b.advance();
    CHECK(b.trials[0].outcome == row.outcome);
    if (row.outcome == Outcome::failed) CHECK(b.trials[0].error->code == Errc::measurement);
  }
}

TEST_CASE("Rest between trials is no fault") {
  Bench b = bench();
  const auto nothing = b.send(RestMeasured{Phase::rest, 5, 0});
  CHECK(nothing.empty());
  CHECK(b.state.step == Step::ready);
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

TEST_CASE("A resumed campaign without trials left has no clean-up") {
  Bench b = bench();
  b.send(Start{b.plan.trials.size()});
  const auto done = only<CampaignDone>(b.effects);
  REQUIRE(done);
  CHECK(done->cleanup == Cleanup::skipped);
  CHECK(done->rig == RigFact::safe);  // its stages are homed
}

TEST_CASE("Recorded phases have the durations of the recipe") {
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
       std::vector<Event>{MotionDone{old}, ForceReached{old, 0.09}, TimerExpired{old}, Biased{old},
                          Mounted{old}, ForceSettled{old}, Start{}}) {
    CHECK(b.send(event).empty());
    CHECK(b.state.step == before.step);
    CHECK(b.state.ticket == before.ticket);
  }
}

TEST_CASE("Every move has a timer that outlasts it, however slow and from wherever z may stand") {
  const std::string slow =
      R"("repetitions": 2, "approach": {"speed_mm_s": 0.02, "seat_speed_mm_s": 0.01})";
  Plan plan = test::plan_of(test::small_with("\"repetitions\": 2", slow));
  plan.limits.max_acceleration_mps2 = 1e-6;  // it reaches none of its speeds
  Bench b(plan);
  const Range& z = plan.limits.geometry.travel[index(Axis::z)];
  int moves = 0;
  for (b.advance(); b.trials.empty(); b.advance()) {
    double lasts_s = 0;
    const auto last = [&](Axis axis, double way_m, double speed) {
      if (is_linear(axis))
        lasts_s =
            std::max(lasts_s, move_duration_s(way_m, speed, plan.limits.max_acceleration_mps2));
    };
    for (const Descend& e : all_of<Descend>(b.effects))
      last(Axis::z, e.target_z_m - plan.limits.clear_z_m(), e.speed_mps);
    for (const Ascend& e : all_of<Ascend>(b.effects))
      last(Axis::z, lowest_z_m(plan.limits) - e.target_z_m, e.speed_mps);
    for (const MoveTo& e : all_of<MoveTo>(b.effects))
      for (const AxisMove& move : e.moves) {
        if (b.state.step == Step::clearing)
          last(move.axis, std::max(move.target - z.min, z.max - move.target), move.speed);
        if (b.state.step == Step::unloading) last(move.axis, plan.limits.rest_travel_m, move.speed);
        if (b.state.step == Step::lowering) last(move.axis, plan.limits.rest_travel_m, move.speed);
      }
    if (lasts_s == 0) continue;
    ++moves;
    CAPTURE(to_string(b.state.step));
    CHECK(to_seconds(b.timer->deadline - b.now) > lasts_s);
  }
  CHECK(moves == 6);  // clearing, approaching, seating, lowering, releasing, unloading
}

TEST_CASE("The timer of lowering outlasts the way back from where a fast way down has taken z") {
  for (const double rest_travel_m : {0.0, 5e-5, 5e-4}) {
    CAPTURE(rest_travel_m);
    Plan plan = test::plan_of(test::small_with(
        "\"repetitions\": 2",
        R"("repetitions": 2, "approach": {"speed_mm_s": 4, "seat_speed_mm_s": 0.02})"));
    plan.limits.rest_travel_m = rest_travel_m;
    Bench b(plan);
    b.advance_to(Step::lowering);
    const double past_m = 4e-3 * 4e-3 / (2 * plan.limits.max_acceleration_mps2);
    const double way_m = b.touch_z_m + past_m - b.commanded_z_m;
    CHECK(to_seconds(b.timer->deadline - b.now) >
          move_duration_s(way_m, 0.02e-3, plan.limits.max_acceleration_mps2));
  }
}

TEST_CASE("The timer of the way back to rest does not wait for a way that the probe cannot be on") {
  Plan plan = test::plan_of(test::small_with(
      "\"repetitions\": 2", R"("repetitions": 2, "approach": {"seat_speed_mm_s": 0.02})"));
  Bench b(plan);
  b.advance_to(Step::seating);
  const auto way_down = b.timer->deadline - b.now;
  b.advance_to(Step::releasing);
  CHECK(to_seconds(b.timer->deadline - b.now) == Approx(to_seconds(way_down)).epsilon(0.01));
}

TEST_CASE("The timer of the way down goes by the speed that a stage reaches within its horizon") {
  Plan plan = test::plan_of(
      test::small_with("\"repetitions\": 2", R"("repetitions": 2, "approach": {"speed_mm_s": 4})"));
  plan.limits.max_acceleration_mps2 = 2e-3;
  plan.limits.clearance_m = 0.09;
  Bench b(plan);
  while (all_of<Descend>(b.effects).empty()) b.advance();
  const double reached_mps = std::sqrt(2 * 2e-3 * 4e-3 * 0.1);  // 1.3 mm/s
  CHECK(to_seconds(b.timer->deadline - b.now) > 0.09 / reached_mps);
}

TEST_CASE("A timer that expires fails the trial, and the campaign stops by default") {
  for (const Step where : {Step::clearing, Step::mounting, Step::positioning, Step::biasing,
                           Step::approaching, Step::seating, Step::lowering, Step::pressing,
                           Step::sliding, Step::releasing, Step::unloading}) {
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
    CHECK_THAT(to_string(*b.trials[0].error), Catch::Contains("trial 1 (denim, M2, repetition 1)"));
    CHECK(b.end->outcome == Outcome::failed);
    CHECK(b.end->rig == RigFact::safe);
  }
}

TEST_CASE("With on_trial_failure continue the campaign continues and reports the failure") {
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
  CHECK(b.trials[0].error->code == Errc::measurement);
  CHECK(b.trials[0].error->got == "none");
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

}  // namespace engine_test
