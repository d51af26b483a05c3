// Retract, park and jog on a run manager: refusals, records, and interruptions. SIMULATED.

#include <nlohmann/json.hpp>

#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace maintenance_service_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using recipes::Axis;
using recipes::MaintenanceKind;
using recipes::MaintenanceOrder;
using test::RunManagerBench;
using test::TemporaryFolder;
using Stop = RigState::Stop;

namespace {

constexpr MaintenanceOrder retract{MaintenanceKind::retract};
constexpr MaintenanceOrder park{MaintenanceKind::park};

Result<MaintenanceSummary> moved(RunManagerBench& bench, const MaintenanceOrder& order) {
  std::optional<Result<MaintenanceSummary>> done;
  bench.manager->maintain(order, "ada", [&](const auto& summary) { done = summary; });
  REQUIRE(bench.posted.run_until([&] { return done.has_value(); }));
  return *done;
}

Errc refused(RunManagerBench& bench, const MaintenanceOrder& order = retract) {
  std::optional<Errc> code;
  bench.manager->maintain(order, "ada", [&](const Result<MaintenanceSummary>& summary) {
    REQUIRE_FALSE(summary);
    code = summary.error().code;
  });
  REQUIRE(code);  // at once
  return *code;
}

/// A run halted with the probe on the fabric, followed by a reset of the rig.
void halt_on_the_cloth(RunManagerBench& bench) {
  const std::string id = bench.submit().stored.id();
  REQUIRE(bench.posted.run_until([&] {
    const auto moment = bench.manager->get(id)->moment;
    return moment && moment->step == recipes::Step::sliding;
  }));
  bench.manager->halt(Stop::halt, "ada");
  bench.ended(id);
  REQUIRE(bench.manager->reset("looked at it", "ada"));
}

double clear_z_m(const RunManagerBench& bench) {
  return open_rig(bench.request.rig, {})->limits.clear_z_m();
}

std::vector<nlohmann::json> journalled(RunManagerBench& bench) {
  std::vector<nlohmann::json> out;
  const auto lines = bench.store.query({.run = {}, .kind = "maintenance"});
  for (const JournalLine& line : lines.value().lines)
    out.push_back(nlohmann::json::parse(line.payload_json));
  return out;
}

}  // namespace

TEST_CASE("retract, park and jog are refused by the rig's state, and nothing is written") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  CHECK(refused(bench, {MaintenanceKind::jog, Axis::x, 0.006}) == Errc::range);
  const std::string id = bench.submit().stored.id();
  CHECK(refused(bench) == Errc::wrong_state);
  CHECK(refused(bench, park) == Errc::wrong_state);
  bench.manager->halt(Stop::halt, "ada");
  bench.ended(id);
  CHECK(refused(bench) == Errc::wrong_state);  // latched
  REQUIRE(bench.manager->reset("looked at it", "ada"));
  bench.manager->close();
  CHECK(refused(bench) == Errc::wrong_state);
  CHECK(journalled(bench).empty());
}

TEST_CASE("after a halt on the cloth and a reset, retract lifts the probe to the clear height") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  halt_on_the_cloth(bench);
  const auto done = moved(bench, retract);
  if (!done) FAIL(to_string(done.error()));
  const recipes::Joints &from = done->begin.from, &to = done->to;
  CHECK(from[Axis::z] > clear_z_m(bench) + 1e-3);
  CHECK(to[Axis::z] == Approx(clear_z_m(bench)).margin(1e-6));
  for (const Axis axis : {Axis::x, Axis::y, Axis::rx, Axis::ry})
    CHECK(to[axis] == Approx(from[axis]).margin(1e-4));
  CHECK_FALSE(done->begin.is_relative);
  CHECK(done->done.outcome == recipes::Outcome::complete);
  CHECK(done->done.rig == recipes::RigFact::safe);
  CHECK(bench.manager->rig_state().facts().fact == RigFact::safe);
  CHECK(bench.store.rig_state()->facts().fact == RigFact::safe);
  const auto lines = journalled(bench);
  REQUIRE(lines.size() == 3);
  CHECK(lines[0].at("state") == "begun");
  CHECK(lines[1].at("state") == "moving");
  CHECK(lines[1].at("from") == lines[2].at("from"));
  CHECK(lines[2].at("state") == "ended");
  CHECK(lines[2].at("to").at("z_m") == to[Axis::z]);
}

TEST_CASE("park goes to the home position; a jog moves one axis; without homing both are refused") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  const auto unhomed = moved(bench, park);  // this bench is not homed
  REQUIRE_FALSE(unhomed);
  CHECK(unhomed.error().code == Errc::wrong_state);
  CHECK(bench.manager->rig_state().facts().fact == RigFact::safe);
  CHECK(bench.store.rig_state()->facts().fact == RigFact::safe);
  halt_on_the_cloth(bench);
  const auto parked = moved(bench, park);
  if (!parked) FAIL(to_string(parked.error()));
  CHECK(parked->done.outcome == recipes::Outcome::complete);
  for (const Axis axis : {Axis::x, Axis::y, Axis::rx, Axis::ry})
    CHECK(parked->to[axis] == Approx(0).margin(1e-5));
  const auto jogged = moved(bench, {MaintenanceKind::jog, Axis::z, 1e-3});
  if (!jogged) FAIL(to_string(jogged.error()));
  CHECK(jogged->to[Axis::z] == Approx(parked->to[Axis::z] + 1e-3).margin(1e-4));
  CHECK(jogged->done.rig == recipes::RigFact::holding);
  CHECK(jogged->to[Axis::x] == parked->to[Axis::x]);
}

TEST_CASE("the rig is unknown in the store while a motion is under way, and nothing else begins") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  halt_on_the_cloth(bench);
  bool seen = false;
  std::string waits;
  bench.at_motion = [&] {
    bench.posted.post([&] {
      seen = true;
      CHECK(bench.store.rig_state()->facts().fact == RigFact::unknown);
      CHECK(bench.manager->status().maintenance == "retract");
      CHECK_FALSE(bench.manager->status().is_at_rest);
      CHECK(refused(bench, park) == Errc::wrong_state);
      CHECK(bench.manager->reset("looked at it", "ada").error().code == Errc::wrong_state);
      waits = bench.submit().stored.id();
      CHECK(bench.manager->get(waits)->state() == RunState::queued);
    });
  };
  REQUIRE(moved(bench, retract));
  CHECK(seen);
  CHECK_FALSE(bench.manager->status().maintenance);
  CHECK(bench.manager->queue().paused_by() == "auto:maintenance");
  REQUIRE(bench.manager->resume_queue("ada"));
  CHECK(bench.ended(waits).stored.outcome == "complete");
}

TEST_CASE("a halt stops a motion and latches the rig; the daemon's end aborts it") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  halt_on_the_cloth(bench);
  bench.at_motion = [&] { bench.posted.post([&] { bench.manager->halt(Stop::halt, "ada"); }); };
  const auto halted = moved(bench, park);
  REQUIRE(halted);
  CHECK(halted->done.outcome == recipes::Outcome::aborted);
  CHECK(halted->done.rig == recipes::RigFact::holding);
  CHECK(halted->to[Axis::z] > clear_z_m(bench) + 1e-3);
  CHECK(bench.manager->rig_state().is_latched());
  CHECK(bench.store.rig_state()->is_latched());
  REQUIRE(bench.manager->reset("looked at it", "ada"));
  bench.at_motion = [&] { bench.posted.post([&] { bench.manager->close(); }); };
  const auto cut = moved(bench, retract);
  REQUIRE(cut);
  CHECK(cut->done.outcome == recipes::Outcome::aborted);
  CHECK(bench.manager->status().is_at_rest);
}

TEST_CASE("a motion that loses its stage leaves the rig unknown until a reset") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  halt_on_the_cloth(bench);
  nlohmann::json rig = test::bench17_near_home();
  rig["simulation"]["faults"] =
      nlohmann::json::parse(R"([{"device": "stage.z", "fault": "unplug", "start_s": 0.5}])");
  test::write_file(bench.request.rig, rig.dump());
  const auto lost = moved(bench, retract);
  if (!lost) FAIL(to_string(lost.error()));
  CHECK(lost->done.outcome == recipes::Outcome::failed);
  CHECK(lost->done.rig == recipes::RigFact::unknown);
  CHECK(bench.manager->rig_state().facts().fact == RigFact::unknown);
  CHECK(bench.store.rig_state()->facts().left_by == "retract (ada)");
  CHECK(refused(bench) == Errc::wrong_state);
  CHECK(bench.manager->reset("looked at it", "ada"));
}

}  // namespace maintenance_service_test
