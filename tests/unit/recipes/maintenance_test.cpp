// Motion outside a campaign: the plan, and the end of the machine in all cases.

#include "recipes/maintenance/maintenance.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "tests/unit/recipes/bench.hpp"

namespace maintenance_test {

using namespace weft;
using namespace weft::recipes;

namespace {

constexpr MaintenanceOrder retract{MaintenanceKind::retract};
constexpr MaintenanceOrder park{MaintenanceKind::park};
constexpr double clear_z_m = 0.092;  // of the test rig

MaintenanceOrder jog(Axis axis, double distance) {
  return {MaintenanceKind::jog, axis, distance};
}

BenchFound found_at(double z_m) {
  BenchFound found{.joints = {{0.03, 0.04, z_m, 0.02, -0.01}}, .force_n = 2.5};
  found.homed.fill(true);
  return found;
}

MaintenancePlan planned(const MaintenanceOrder& order, const BenchFound& found) {
  auto plan = plan_maintenance(test::limits(), order, found);
  if (!plan) FAIL(to_string(plan.error()));
  return *std::move(plan);
}

Errc refused(const MaintenanceOrder& order, const BenchFound& found) {
  const auto plan = plan_maintenance(test::limits(), order, found);
  REQUIRE_FALSE(plan);
  return plan.error().code;
}

/// A machine in progress, with its last requests.
struct Machine {
  explicit Machine(MaintenancePlan of) : plan(std::move(of)) { send(Start{}); }

  void send(const Event& event) {
    MaintenanceTransition next = step(plan, state, event, {});
    state = std::move(next.next);
    stopped = false;
    for (const MaintenanceEffect& effect : next.effects) {
      if (std::holds_alternative<StopMotion>(effect)) stopped = true;
      if (const auto* move = std::get_if<MoveTo>(&effect)) moves.push_back(*move);
      if (const auto* descend = std::get_if<Descend>(&effect)) descent = *descend;
      if (const auto* end = std::get_if<MaintenanceDone>(&effect)) done = *end;
    }
  }
  void arrive() { send(MotionDone{state.ticket}); }

  MaintenancePlan plan;
  MaintenanceState state;
  std::vector<MoveTo> moves;
  std::optional<Descend> descent;
  std::optional<MaintenanceDone> done;
  bool stopped = false;
};

GuardTripped trip(Guard guard, GuardAction action) {
  return {{guard, action, Error{.code = Errc::safety, .what = "tripped"}}};
}
const GuardTripped force_cap = trip(Guard::force_cap, GuardAction::fail_trial);

}  // namespace

TEST_CASE("retract moves z up to the clear height and nothing else") {
  Machine machine(planned(retract, found_at(0.0995)));
  REQUIRE(machine.moves.size() == 1);
  REQUIRE(machine.moves[0].moves.size() == 1);
  const AxisMove& lift = machine.moves[0].moves[0];
  CHECK(lift.axis == Axis::z);
  CHECK(lift.target == Approx(clear_z_m));
  CHECK(lift.speed == 0.004);
  CHECK_FALSE(lift.unhomed);
  machine.arrive();
  REQUIRE(machine.done);
  CHECK(machine.done->outcome == Outcome::complete);
  CHECK(machine.done->rig == RigFact::safe);
}

TEST_CASE("retract never lowers a probe that is above the clear height") {
  Machine machine(planned(retract, found_at(0.01)));
  CHECK(machine.moves.empty());
  REQUIRE(machine.done);
  CHECK(machine.done->outcome == Outcome::complete);
  CHECK(machine.done->rig == RigFact::safe);
}

TEST_CASE("retract of a z that has not been homed goes up by the clearance, slowly") {
  BenchFound found = found_at(0);
  found.homed[index(Axis::z)] = false;
  Machine machine(planned(retract, found));
  CHECK(machine.plan.is_relative);
  CHECK(machine.plan.limits.geometry.travel[index(Axis::z)].contains(-0.008));
  REQUIRE(machine.moves.size() == 1);
  const AxisMove& lift = machine.moves[0].moves.at(0);
  CHECK(lift.target == Approx(-0.008));
  CHECK(lift.speed == Approx(0.0004));
  CHECK(lift.unhomed);
  machine.arrive();
  REQUIRE(machine.done);
  CHECK(machine.done->rig == RigFact::holding);  // its height is unknown
}

TEST_CASE("park lifts first and then moves the other axes to the park position") {
  const std::string rig =
      test::with(test::rig_json, "\"control\"", R"("park": {"x_mm": 140, "ry_deg": 2}, "control")");
  const auto limits = parse_rig_limits(rig);
  REQUIRE(limits);
  auto plan = plan_maintenance(*limits, park, found_at(0.0995));
  REQUIRE(plan);
  Machine machine(*std::move(plan));
  REQUIRE(machine.moves.size() == 1);
  CHECK(machine.moves[0].moves.at(0).axis == Axis::z);
  machine.arrive();
  REQUIRE(machine.moves.size() == 2);
  const std::vector<AxisMove>& across = machine.moves[1].moves;
  REQUIRE(across.size() == 4);
  const std::array<double, 4> targets{0.14, 0, 0, 2 * rad_per_deg};
  const std::array axes{Axis::x, Axis::y, Axis::rx, Axis::ry};
  for (std::size_t i = 0; i < across.size(); ++i) {
    CHECK(across[i].axis == axes[i]);
    CHECK(across[i].target == Approx(targets[i]));
    CHECK(across[i].speed <= (is_linear(axes[i]) ? 0.004 : 0.1));
  }
  machine.arrive();
  REQUIRE(machine.done);
  CHECK(machine.done->rig == RigFact::safe);
}

TEST_CASE("park and jog need stages that have been homed; nothing homes them") {
  BenchFound found = found_at(0.05);
  found.homed[index(Axis::y)] = false;
  CHECK(refused(park, found) == Errc::wrong_state);
  CHECK(refused(jog(Axis::y, 0.001), found) == Errc::wrong_state);
  CHECK_FALSE(planned(jog(Axis::x, 0.001), found).legs.empty());
}

TEST_CASE("a jog is at most 5 mm or 1 degree, within the travel and not below the plate") {
  const BenchFound found = found_at(0.0995);
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  for (const double far : {0.0, none, 0.0051, -0.0051})
    CHECK(refused(jog(Axis::x, far), found) == Errc::range);
  CHECK(refused(jog(Axis::rx, 1.01 * rad_per_deg), found) == Errc::range);
  BenchFound at_end = found;
  at_end.joints[Axis::x] = 0.149;
  CHECK(refused(jog(Axis::x, 0.002), at_end) == Errc::range);
  CHECK(refused(jog(Axis::z, 0.002), found) == Errc::range);  // 1.5 mm below the bare plate
  const MaintenancePlan across = planned(jog(Axis::x, -0.005), found);
  REQUIRE(across.legs.size() == 1);
  CHECK(across.legs[0].moves.at(0).target == Approx(0.025));
  CHECK(across.legs[0].moves.at(0).speed == Approx(0.0004));
  const MaintenancePlan turn = planned(jog(Axis::rx, rad_per_deg), found);
  CHECK(turn.legs.at(0).moves.at(0).speed == Approx(0.01));
}

TEST_CASE("a jog that does not lift stops at a change of 1 N, and never passes the rig's cap") {
  BenchFound found = found_at(0.08);
  for (const Axis axis : {Axis::x, Axis::y, Axis::z, Axis::rx, Axis::ry})
    CHECK(planned(jog(axis, 0.001), found).limits.force_cap_n == 1);
  CHECK(planned(jog(Axis::z, -0.001), found).limits.force_cap_n == 10);
  found.force_n = 9.5;
  CHECK(planned(jog(Axis::z, 0.001), found).limits.force_cap_n == Approx(0.5));
  for (const auto& force : {std::optional<double>(10.0), std::optional<double>()}) {
    found.force_n = force;
    CHECK(refused(jog(Axis::z, 0.001), found) == Errc::measurement);
    CHECK_FALSE(planned(jog(Axis::z, -0.001), found).legs.empty());
  }
}

TEST_CASE("a jog downwards is driven by velocities and stops at the force") {
  Machine machine(planned(jog(Axis::z, 0.002), found_at(0.091)));
  CHECK(machine.moves.empty());
  REQUIRE(machine.descent);
  CHECK(machine.descent->target_z_m == Approx(0.093));
  CHECK(machine.descent->speed_mps == Approx(0.0004));
  CHECK(machine.descent->stop_force_n == 1);
  machine.send(force_cap);
  CHECK(machine.stopped);
  REQUIRE(machine.done);
  CHECK(machine.done->outcome == Outcome::failed);
  CHECK(machine.done->rig == RigFact::holding);
}

TEST_CASE("a way up goes on after guards and faults of other devices, a way across ends") {
  Machine machine(planned(park, found_at(0.0995)));
  machine.send(force_cap);
  machine.send(Fault{Error{.code = Errc::timeout, .where = "taxels", .what = "silent"}});
  CHECK_FALSE(machine.stopped);
  CHECK_FALSE(machine.done);
  machine.arrive();
  REQUIRE(machine.done);  // it is up, but nothing follows on a bench with a fault
  CHECK(machine.moves.size() == 1);
  CHECK(machine.done->outcome == Outcome::failed);
  CHECK(machine.done->rig == RigFact::safe);
  CHECK(machine.done->error->code == Errc::safety);
}

TEST_CASE("what ends a motion, and what is known of the rig then") {
  struct Row {
    Event event;
    Outcome outcome;
    RigFact rig;
  };
  const Error why{.code = Errc::device, .what = "broken"};
  const std::vector<Row> rows{
      {HaltRequested{}, Outcome::aborted, RigFact::safe},
      {AbortRequested{}, Outcome::aborted, RigFact::safe},
      {StopRequested{}, Outcome::stopped, RigFact::safe},
      {force_cap, Outcome::failed, RigFact::safe},
      {trip(Guard::travel, GuardAction::end_campaign), Outcome::failed, RigFact::unknown},
      {Fault{why}, Outcome::failed, RigFact::unknown}};
  for (const Row& row : rows) {
    Machine machine(planned(park, found_at(0.01)));  // already up: moves across at once
    machine.send(row.event);
    CAPTURE(row.event.index());
    CHECK(machine.stopped);
    REQUIRE(machine.done);
    CHECK(machine.done->outcome == row.outcome);
    CHECK(machine.done->rig == row.rig);
    machine.send(MotionDone{machine.state.ticket});
    CHECK(machine.moves.size() == 1);  // nothing follows an end
  }
  Machine lost(planned(retract, found_at(0.0995)));
  lost.send(MotionLost{lost.state.ticket});
  REQUIRE(lost.done);
  CHECK(lost.done->rig == RigFact::unknown);
  Machine late(planned(retract, found_at(0.0995)));
  late.send(TimerExpired{late.state.ticket});
  REQUIRE(late.done);
  CHECK(late.done->rig == RigFact::unknown);
  CHECK(late.done->error->code == Errc::timeout);
}

TEST_CASE("a retract that is halted leaves the rig holding") {
  Machine machine(planned(retract, found_at(0.0995)));
  machine.send(HaltRequested{});
  CHECK(machine.stopped);
  REQUIRE(machine.done);
  CHECK(machine.done->outcome == Outcome::aborted);
  CHECK(machine.done->rig == RigFact::holding);
}

}  // namespace maintenance_test
