#include "recipes/alignment/alignment.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "protocols/base/time.hpp"
#include "tests/unit/recipes/bench.hpp"

namespace alignment_test {

using namespace weft;
using namespace weft::recipes;

namespace {

/// A tilted plate under a point probe, by rotation in three dimensions: answers the machine's
/// effects at once. Angles like simulation.plate_tilt_deg.
struct TestPlant {
  double tilt_x_rad = 0, tilt_y_rad = 0;
  double noise_m = 0;   ///< standard deviation of a contact height
  double dent_m = 0;    ///< in the plate's first quarter
  bool plate = true;    ///< there is a plate
  double rx_scale = 1;  ///< scale error of the rotary stage
  Joints at;
  std::mt19937 random{1};
  std::size_t touches = 0;
  double highest_crossing_m = -1;  ///< height of the surface over the probe while x or y moved

  /// z at which the probe meets the plate at the present stage positions.
  [[nodiscard]] double surface_z_m(const Geometry& g) const {
    const double rx = at[Axis::rx] * rx_scale;
    const double c = std::cos(rx), s = std::sin(rx);
    // The plate's normal on the platform, then turned about x with it.
    const double nx = -std::tan(tilt_y_rad) / std::cos(tilt_x_rad), ny = -std::tan(tilt_x_rad);
    const double wy = c * ny - s, wz = s * ny + c;
    const double x = at[Axis::x] - g.origin_m.x_m - g.plate_size_m.x_m / 2;
    const double y = at[Axis::y] - g.origin_m.y_m - g.tilt_axis_y_m;
    const double rise = -(nx * x + wy * y) / wz;
    const bool dented = x < -0.01 && y < -0.01;
    return g.surface_z_m - rise + (dented ? dent_m : 0);
  }
};

/// Executes one effect; returns the event that answers it, if any.
std::optional<Event> answer(TestPlant& bench_plant, const Geometry& g, const AlignEffect& effect) {
  if (const auto* move = std::get_if<MoveTo>(&effect)) {
    for (const AxisMove& m : move->moves) {
      bench_plant.at[m.axis] = m.target;
      if (m.axis != Axis::z)
        bench_plant.highest_crossing_m = std::max(
            bench_plant.highest_crossing_m, bench_plant.at[Axis::z] - bench_plant.surface_z_m(g));
    }
    return MotionDone{move->ticket};
  }
  if (const auto* bias = std::get_if<BiasSensors>(&effect)) return Biased{bias->ticket};
  const auto* descend = std::get_if<Descend>(&effect);
  if (descend == nullptr) return std::nullopt;
  std::normal_distribution<double> noise(0, 1);
  const double met = bench_plant.surface_z_m(g) + bench_plant.noise_m * noise(bench_plant.random);
  if (!bench_plant.plate || met > descend->target_z_m) {
    bench_plant.at[Axis::z] = descend->target_z_m;
    return MotionDone{descend->ticket};
  }
  ++bench_plant.touches;
  bench_plant.at[Axis::z] = met;
  return ForceReached{descend->ticket, met};
}

struct Ended {
  AlignState state;
  AlignDone done;
};

Ended align(TestPlant& bench_plant, const AlignPlan& plan) {
  AlignState state;
  std::vector<Event> events{Start{}};
  for (int i = 0; i < 10000 && !events.empty(); ++i) {
    AlignTransition next = step(plan, state, events.front(), TimePoint{});
    events.erase(events.begin());
    state = std::move(next.next);
    for (const AlignEffect& effect : next.effects) {
      if (const auto* done = std::get_if<AlignDone>(&effect)) return {state, *done};
      if (auto event = answer(bench_plant, plan.limits.geometry, effect)) events.push_back(*event);
    }
  }
  FAIL("the machine waits for ever in " << to_string(state.step));
  return {};
}

AlignPlan plan_with(const AlignSettings& settings = {}) {
  auto plan = plan_alignment(test::limits(), settings);
  REQUIRE(plan);
  return *plan;
}

std::string refusal(const AlignSettings& settings) {
  const auto plan = plan_alignment(test::limits(), settings);
  REQUIRE_FALSE(plan);
  return to_string(plan.error());
}

}  // namespace

TEST_CASE("A tilted plate is found to 1e-9 rad, levelled, and found level by the next touches") {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> tilt(-2 * rad_per_deg, 2 * rad_per_deg);
  for (int i = 0; i < 50; ++i) {
    TestPlant bench_plant;
    bench_plant.tilt_x_rad = tilt(random);
    bench_plant.tilt_y_rad = tilt(random);
    const auto [state, done] = align(bench_plant, plan_with());
    REQUIRE(done.outcome == Outcome::complete);
    REQUIRE_FALSE(done.error);
    REQUIRE(state.rounds.size() == 2);
    const TiltFound& before = state.rounds.front();
    REQUIRE(std::abs(before.tilt_x_rad - bench_plant.tilt_x_rad) < 1e-9);
    REQUIRE(std::abs(before.tilt_y_rad - bench_plant.tilt_y_rad) < 1e-9);
    REQUIRE(std::abs(bench_plant.at[Axis::rx] + bench_plant.tilt_x_rad) < 1e-9);
    REQUIRE(std::abs(bench_plant.at[Axis::ry] - bench_plant.tilt_y_rad) < 1e-9);
    REQUIRE(state.rounds.back().lean_rad < 1e-9);
    REQUIRE(bench_plant.highest_crossing_m < 0);  // it never moved sideways through the plate
    REQUIRE(bench_plant.touches == 2 * 2 * 9);    // fast and slow, two rounds
  }
}

TEST_CASE("With noisy touches what is left lies within three of the stated deviations") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> tilt(-2 * rad_per_deg, 2 * rad_per_deg);
  int beyond = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    TestPlant bench_plant;
    bench_plant.random.seed(seed);
    bench_plant.tilt_x_rad = tilt(random);
    bench_plant.tilt_y_rad = tilt(random);
    bench_plant.noise_m = 1e-6;
    const auto [state, done] = align(bench_plant, plan_with());
    REQUIRE(done.outcome == Outcome::complete);
    const double left = std::hypot(bench_plant.at[Axis::rx] + bench_plant.tilt_x_rad,
                                   bench_plant.at[Axis::ry] - bench_plant.tilt_y_rad);
    beyond += left > 3 * state.rounds.front().lean_sd_rad ? 1 : 0;
    REQUIRE(left < 50e-6);
  }
  CHECK(beyond <= 3);
}

TEST_CASE("A level plate is left alone after one round") {
  TestPlant bench_plant;
  const auto [state, done] = align(bench_plant, plan_with());
  CHECK(done.outcome == Outcome::complete);
  CHECK(state.rounds.size() == 1);
  CHECK(bench_plant.at[Axis::rx] == 0);
}

TEST_CASE("A surface that is no plane is refused, and nothing is turned") {
  TestPlant bench_plant;
  bench_plant.dent_m = 200e-6;
  const auto [state, done] = align(bench_plant, plan_with());
  CHECK(done.outcome == Outcome::failed);
  CHECK(done.cleanup == Cleanup::done);
  CHECK(done.rig == RigFact::safe);
  REQUIRE(done.error);
  CHECK(done.error->code == Errc::measurement);
  CHECK(done.error->got.ends_with(" um"));
  CHECK(bench_plant.at[Axis::rx] == 0);
  CHECK(bench_plant.at[Axis::z] < test::limits().clear_z_m());
}

TEST_CASE("A tilt beyond the rotary travel is refused before anything turns") {
  TestPlant bench_plant;
  bench_plant.tilt_x_rad = 5.5 * rad_per_deg;
  AlignSettings settings;
  settings.largest_tilt_rad = 8 * rad_per_deg;
  const auto [state, done] = align(bench_plant, plan_with(settings));
  CHECK(done.outcome == Outcome::failed);
  REQUIRE(done.error);
  CHECK(done.error->code == Errc::range);
  CHECK(done.error->what.ends_with(" rx"));
  CHECK(state.rounds.size() == 1);
  CHECK(bench_plant.at[Axis::rx] == 0);
}

TEST_CASE("Without a plate the search ends at its lowest height and the probe goes up") {
  TestPlant bench_plant;
  bench_plant.plate = false;
  const auto [state, done] = align(bench_plant, plan_with());
  CHECK(done.outcome == Outcome::failed);
  REQUIRE(done.error);
  CHECK(done.error->code == Errc::measurement);
  CHECK(done.error->got == "none");
  CHECK(bench_plant.at[Axis::z] < test::limits().clear_z_m());
}

TEST_CASE("A rotary stage that turns the wrong way is given up after three corrections") {
  TestPlant bench_plant;
  bench_plant.tilt_x_rad = 0.2 * rad_per_deg;
  bench_plant.rx_scale = -0.5;
  const auto [state, done] = align(bench_plant, plan_with());
  CHECK(done.outcome == Outcome::failed);
  REQUIRE(done.error);
  CHECK(done.error->code == Errc::measurement);
  CHECK_THAT(done.error->what, Catch::Contains("3 corrections"));
  CHECK(state.rounds.size() == 4);
}

TEST_CASE("A stage with a scale error of two per cent is levelled by a second correction") {
  TestPlant bench_plant;
  bench_plant.tilt_x_rad = 2 * rad_per_deg;
  bench_plant.rx_scale = 1.02;
  const auto [state, done] = align(bench_plant, plan_with());
  CHECK(done.outcome == Outcome::complete);
  CHECK(state.rounds.size() == 3);
  CHECK(std::abs(bench_plant.at[Axis::rx] * bench_plant.rx_scale + bench_plant.tilt_x_rad) <
        100e-6);
}

TEST_CASE("A force over the cap ends the alignment with the guard's sentence and a retreat") {
  const AlignPlan plan = plan_with();
  AlignState state = step(plan, {}, Start{}, TimePoint{}).next;
  const GuardTrip trip{Guard::force_cap,
                       GuardAction::fail_trial,
                       {.code = Errc::safety, .what = "the force is over its cap"}};
  const AlignTransition next = step(plan, state, GuardTripped{trip}, TimePoint{});
  CHECK(next.next.step == AlignStep::retracting);
  CHECK(std::holds_alternative<StopMotion>(next.effects.front()));
  const AlignTransition end = step(plan, next.next, MotionDone{next.next.ticket}, TimePoint{});
  REQUIRE(std::holds_alternative<AlignDone>(end.effects.back()));
  const auto& done = std::get<AlignDone>(end.effects.back());
  CHECK(done.outcome == Outcome::failed);
  CHECK(done.error->what == "the force is over its cap");
}

TEST_CASE("Every step of the machine has a timer, and any timer leads to the end") {
  TestPlant bench_plant;
  bench_plant.tilt_x_rad = 0.01;
  const AlignPlan plan = plan_with();
  AlignState state;
  Event event = Start{};
  for (int steps = 0; state.step != AlignStep::done; ++steps) {
    REQUIRE(steps < 1000);
    AlignTransition next = step(plan, state, event, TimePoint{});
    state = next.next;
    bool timed = false;
    for (const AlignEffect& effect : next.effects) {
      timed = timed || std::holds_alternative<ArmTimer>(effect);
      if (auto reply = answer(bench_plant, plan.limits.geometry, effect)) event = *reply;
    }
    if (state.step == AlignStep::done) break;
    REQUIRE(timed);
    AlignState late = step(plan, state, TimerExpired{state.ticket}, TimePoint{}).next;
    late = step(plan, late, TimerExpired{late.ticket}, TimePoint{}).next;
    REQUIRE(late.step == AlignStep::done);
    REQUIRE(late.outcome == Outcome::failed);
    REQUIRE(step(plan, state, TimerExpired{state.ticket + 7}, TimePoint{}).next.step == state.step);
  }
}

TEST_CASE("An abort raises the probe; during the retreat it changes nothing but the outcome") {
  const AlignPlan plan = plan_with();
  AlignState state = step(plan, {}, Start{}, TimePoint{}).next;
  state = step(plan, state, AbortRequested{}, TimePoint{}).next;
  CHECK(state.step == AlignStep::retracting);
  CHECK(step(plan, state, AbortRequested{}, TimePoint{}).effects.empty());
  const auto end = step(plan, state, MotionDone{state.ticket}, TimePoint{});
  CHECK(std::get<AlignDone>(end.effects.back()).outcome == Outcome::aborted);
}

TEST_CASE("The rig is safe after a retreat that arrived, holds after a halt, and is unknown else") {
  const AlignPlan plan = plan_with();
  const AlignState up = step(plan, {}, Start{}, TimePoint{}).next;
  const AlignState back = step(plan, up, AbortRequested{}, TimePoint{}).next;
  const auto ended_with = [&](const AlignState& state, const Event& event) {
    return std::get<AlignDone>(step(plan, state, event, TimePoint{}).effects.back());
  };
  CHECK(ended_with(back, MotionDone{back.ticket}).rig == RigFact::safe);
  const AlignDone late = ended_with(back, TimerExpired{back.ticket});
  CHECK(late.cleanup == Cleanup::failed);
  CHECK(late.rig == RigFact::unknown);
  const AlignDone lost = ended_with(back, MotionLost{back.ticket});
  CHECK(lost.outcome == Outcome::failed);
  CHECK(lost.cleanup == Cleanup::failed);
  CHECK(lost.rig == RigFact::unknown);
  CHECK(step(plan, back, MotionLost{back.ticket - 1}, TimePoint{}).effects.empty());
  CHECK(step(plan, up, MotionLost{up.ticket}, TimePoint{}).effects.empty());
  CHECK(ended_with(up, HaltRequested{}).rig == RigFact::holding);
  CHECK(ended_with({}, AbortRequested{}).rig == RigFact::holding);
}

TEST_CASE("Settings that do not fit the rig are refused before anything moves") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THAT(refusal({.span_m = 0.2}), Catch::Contains("span"));
  CHECK_THAT(refusal({.span_m = nan}), Catch::Contains("span"));
  CHECK_THAT(refusal({.per_side = 1}), Catch::Contains("1 (expected 2 to 9)"));
  CHECK_THAT(refusal({.contact_force_n = 0.01}), Catch::Contains(": 0.010000 N ("));
  CHECK_THAT(refusal({.contact_force_n = 8}), Catch::Contains("limits.force_cap_N"));
  CHECK_THAT(refusal({.touch_speed_mps = 0.1}), Catch::Contains("limits.speed_mm_s"));
  CHECK_THAT(refusal({.largest_residual_m = 0}), Catch::Contains("residual"));
  CHECK_THAT(refusal({.tolerance_rad = nan}), Catch::Contains("tolerance"));
  CHECK_THAT(refusal({.largest_tilt_rad = 0.6}),
             Catch::Contains("0.600000 rad (expected at most 0.5 rad)"));
  RigLimits low = test::limits();
  low.geometry.surface_z_m = 0.012;
  const auto plan = plan_alignment(low, {});
  REQUIRE_FALSE(plan);
  CHECK_THAT(plan.error().what, Catch::Contains(" z "));
}

}  // namespace alignment_test
