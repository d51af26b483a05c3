// Rigs that differ from the 5-DoF bench: axes without a stage.

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/campaign/bench_check.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "recipes/alignment/align_plan.hpp"
#include "recipes/maintenance/maintenance.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace other_rigs_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::request_in;
using test::short_recipe;
using test::TemporaryFolder;

namespace {

void drop(json& rig, const std::string& role) {
  json& devices = rig["devices"];
  const auto found = std::find_if(devices.begin(), devices.end(),
                                  [&](const json& device) { return device["role"] == role; });
  REQUIRE(found != devices.end());
  devices.erase(found);
}

/// bench17 without these stages; `fixed` has the positions of their axes.
json rig_without(const std::vector<std::string>& roles, const json& fixed) {
  json rig = test::bench17_near_home();
  rig["fixed"] = fixed;
  for (const std::string& role : roles) {
    drop(rig, role);
    rig["limits"]["travel_mm"].erase(role);
  }
  if (fixed.contains("rx_deg") && fixed.contains("ry_deg")) rig["limits"].erase("tilt_deg");
  return rig;
}

json xyz_rig() {
  return rig_without({"rx", "ry"}, {{"rx_deg", 0}, {"ry_deg", 0}});
}

json xz_rig() {
  return rig_without({"y", "rx", "ry"}, {{"y_mm", 17}, {"rx_deg", 0}, {"ry_deg", 0}});
}

/// bench17 without its force sensor.
json wrenchless_rig() {
  json rig = rig_without({"wrench"}, json::object());
  json& limits = rig["limits"];
  for (const char* const key : {"force_cap_N", "torque_cap_Nm"}) limits.erase(key);
  limits["taxel_cap_counts"] = 8000;
  limits["press_depth_mm"] = 2;
  rig["probe"]["touch_counts"] = 20;
  return rig;
}

/// short_recipe() with presses of this depth.
json recipe_by_depth(double depth_mm) {
  json recipe = json::parse(short_recipe("denim"));
  for (json& exploration : recipe["explorations"])
    for (json& phase : exploration["phases"]) {
      phase.erase("force_N");
      phase.erase("force_band_N");
      if (phase["phase"] == "P") phase["press_depth_mm"] = depth_mm;
    }
  return recipe;
}

/// Strokes along x only.
std::string recipe_along_x() {
  json recipe = json::parse(short_recipe("denim"));
  recipe["explorations"].erase("M2");
  recipe["explorations"]["M1"]["phases"][2]["path"] = {{{"dx_mm", 6}, {"dy_mm", 0}}};
  recipe["repetitions"] = 2;
  return recipe.dump();
}

Dataset recorded(const json& rig, const std::string& recipe) {
  const TemporaryFolder folder;
  const auto run = run_campaign(request_in(folder, recipe, rig), {});
  if (!run) FAIL(to_string(run.error()));
  INFO((run->error ? to_string(*run->error) : std::string("no error")));
  REQUIRE(run->outcome == recipes::Outcome::complete);
  CHECK(run->trials_complete == 2);
  const auto verified = verify(folder / "out");
  REQUIRE(verified);
  CHECK(verified->holds());
  auto data = read_hdf5(run->dataset_file);
  if (!data) FAIL(to_string(data.error()));
  return std::move(*data);
}

Error refusal(const json& rig) {
  const Result<RigFile> parsed = parse_rig_file(rig.dump());
  REQUIRE_FALSE(parsed);
  return parsed.error();
}

/// Range of the recorded positions of an axis [m] or [rad], by its place in x, y, z, rx, ry.
std::pair<double, double> range_of(const Dataset& data, std::size_t axis) {
  const std::vector<std::int32_t>& all = data.records.at(0).stages.quanta;
  std::int32_t least = all.at(axis), most = least;
  for (std::size_t i = axis; i < all.size(); i += recipes::axis_count) {
    least = std::min(least, all[i]);
    most = std::max(most, all[i]);
  }
  const double per_unit = data.info.axes.at(axis).quanta_per_unit();
  return {least / per_unit, most / per_unit};
}

}  // namespace

TEST_CASE("a campaign on an xyz rig is complete, and the data set has its tilts where they are") {
  const Dataset data = recorded(xyz_rig(), short_recipe("denim"));
  CHECK(range_of(data, 3) == std::pair{0.0, 0.0});
  CHECK(range_of(data, 4) == std::pair{0.0, 0.0});
  const auto [least_y, most_y] = range_of(data, 1);
  CHECK(most_y - least_y == Approx(6e-3).margin(1e-4));
}

TEST_CASE("a campaign on an xz rig slides along x alone") {
  const Dataset data = recorded(xz_rig(), recipe_along_x());
  CHECK(range_of(data, 1).first == Approx(17e-3));
  CHECK(range_of(data, 1).second == Approx(17e-3));
  const auto [least_x, most_x] = range_of(data, 0);
  CHECK(most_x - least_x == Approx(6e-3).margin(1e-4));
}

TEST_CASE("new patches of an xz rig lie along x") {
  json recipe = json::parse(recipe_along_x());
  recipe["repetition"] = {{"path", "new_patch"}};
  json rig = xz_rig();
  rig["plate"]["size_mm"] = {60, 34};
  rig["limits"]["travel_mm"]["x"] = {0, 150};
  const TemporaryFolder folder;
  const auto checked = check_request(request_in(folder, recipe.dump(), rig));
  if (!checked) FAIL(to_string(checked.error()));
  const auto& trials = checked->plan.trials;
  REQUIRE(trials.size() == 2);
  CHECK(trials[1].place.offset_m.x_m != 0);
  CHECK(trials[1].place.offset_m.y_m == Approx(0).margin(1e-12));
}

TEST_CASE("what a fixed axis would have to move for is refused before anything moves") {
  const TemporaryFolder folder;
  const auto slides_in_y = check_request(request_in(folder, short_recipe("denim"), xz_rig()));
  REQUIRE_FALSE(slides_in_y);
  CHECK_THAT(to_string(slides_in_y.error()),
             Catch::Contains("/explorations/M1/phases/2/path") && Catch::Contains("stage"));
  json tilted = xyz_rig();
  tilted["plate"]["level"] = {{"rx_deg", 0.5}, {"ry_deg", 0}};
  const auto level = check_request(request_in(folder, recipe_along_x(), tilted));
  REQUIRE_FALSE(level);
  CHECK_THAT(to_string(level.error()), Catch::Contains("/plate/level/rx_deg"));
}

TEST_CASE("an axis is a device's role or fixed, never both and never neither") {
  json neither = xyz_rig();
  neither["fixed"].erase("rx_deg");
  CHECK(refusal(neither).where == "/devices");
  CHECK_THAT(refusal(neither).hint, Catch::Contains("\"rx_deg\""));
  json both = test::bench17_near_home();
  both["fixed"] = {{"rx_deg", 0}};
  CHECK(refusal(both).where == "/fixed/rx_deg");
  json no_z = rig_without({"z"}, {{"z_mm", 5}});
  CHECK(refusal(no_z).where == "/fixed/z_mm");
}

TEST_CASE("a jog of a fixed axis is refused, and a park leaves it out") {
  const TemporaryFolder folder;
  const CampaignRequest request = request_in(folder, recipe_along_x(), xz_rig());
  const auto opened = open_rig(request.rig, {});
  REQUIRE(opened);
  recipes::BenchFound found{.joints = {{0.01, 0.017, 0.002, 0, 0}}, .force_n = 0.1};
  found.homed.fill(true);
  const auto jog =
      plan_maintenance(opened->limits, {recipes::MaintenanceKind::jog, StageAxis::y, 1e-3}, found);
  REQUIRE_FALSE(jog);
  CHECK(jog.error().code == Errc::unsupported);
  const auto park = plan_maintenance(opened->limits, {recipes::MaintenanceKind::park}, found);
  REQUIRE(park);
  for (const recipes::MaintenanceLeg& leg : park->legs)
    for (const recipes::AxisMove& move : leg.moves)
      CHECK((move.axis == StageAxis::x || move.axis == StageAxis::z));
  const auto align = recipes::plan_alignment(opened->limits, {});
  REQUIRE_FALSE(align);
  CHECK(align.error().code == Errc::unsupported);
}

namespace {

/// Mean count of all taxels in a phase.
double mean_in(const classifier::Trial& trial, Phase phase) {
  double sum = 0;
  std::size_t values = 0;
  for (std::size_t i = 0; i < trial.phase.size(); ++i) {
    if (trial.phase[i] != phase) continue;
    for (std::size_t pad = 0; pad < trial.taxels; ++pad, ++values)
      sum += trial.counts[i * trial.taxels + pad];
  }
  REQUIRE(values > 0);
  return sum / static_cast<double>(values);
}

}  // namespace

TEST_CASE("without a force sensor a recipe presses by depth, and the data set has no force") {
  const Dataset data = recorded(wrenchless_rig(), recipe_by_depth(1.6).dump());
  CHECK(data.info.wrench_rate_hz == 0);
  for (std::size_t i = 0; i < data.trials.size(); ++i) {
    const TrialRecord& record = data.records[i];
    CHECK(record.wrench.samples() == 0);
    CHECK_FALSE(record.quality.force_rms_error_n);
    CHECK_FALSE(record.quality.force_in_band_fraction);
    CHECK_FALSE(record.quality.rest);
    // The probe presses harder in P than by its weight in S, and M keeps the depth of P.
    const double rest = mean_in(data.trials[i], Phase::rest);
    const double press = mean_in(data.trials[i], Phase::press);
    CHECK(std::abs(press - rest) > 20);
    CHECK(mean_in(data.trials[i], Phase::motion) != rest);
    CHECK(mean_in(data.trials[i], Phase::end) == Approx(rest).margin(0.5 * std::abs(press - rest)));
  }
}

TEST_CASE("z presses as deep as asked, below where the taxels touched") {
  const Dataset data = recorded(wrenchless_rig(), recipe_by_depth(1.6).dump());
  const auto [least_z, most_z] = range_of(data, 2);
  // Recorded phases range from the rest, 0.5 mm below first contact, to the press.
  CHECK(most_z - least_z == Approx(1.6e-3 - 0.5e-3).margin(20e-6));
}

TEST_CASE("a rig without a force sensor refuses newtons, with the reason") {
  const TemporaryFolder folder;
  const auto newtons = check_request(request_in(folder, short_recipe("denim"), wrenchless_rig()));
  REQUIRE_FALSE(newtons);
  CHECK_THAT(to_string(newtons.error()), Catch::Contains("/explorations/M1/phases/1/force_N") &&
                                             Catch::Contains("force sensor"));
  const auto too_deep =
      check_request(request_in(folder, recipe_by_depth(2.1).dump(), wrenchless_rig()));
  REQUIRE_FALSE(too_deep);
  CHECK_THAT(to_string(too_deep.error()), Catch::Contains("press_depth_mm"));
  const auto with_sensor = check_request(request_in(folder, recipe_by_depth(1.6).dump()));
  REQUIRE_FALSE(with_sensor);
  CHECK_THAT(to_string(with_sensor.error()), Catch::Contains("press_depth_mm"));
}

TEST_CASE("limits of a rig without a force sensor are stated, and a force cap is none of them") {
  const auto refused = [](const char* pointer, const json& rig) {
    const auto limits = recipes::parse_rig_limits(rig.dump());
    REQUIRE_FALSE(limits);
    CHECK_THAT(to_string(limits.error()), Catch::Contains(pointer));
  };
  for (const char* const key : {"taxel_cap_counts", "press_depth_mm"}) {
    json rig = wrenchless_rig();
    rig["limits"].erase(key);
    refused(key, rig);
  }
  json rig = wrenchless_rig();
  rig["probe"].erase("touch_counts");
  refused("touch_counts", rig);
  rig = wrenchless_rig();
  rig["limits"]["force_cap_N"] = 10;
  refused("/limits/force_cap_N", rig);
  json blind = wrenchless_rig();
  drop(blind, "taxels");
  CHECK(refusal(blind).where == "/devices");
}

TEST_CASE("a contact that the taxels do not show fails the trial with the probe retracted") {
  json rig = wrenchless_rig();
  rig["probe"]["touch_counts"] = 7000;
  const TemporaryFolder folder;
  const auto run = run_campaign(request_in(folder, recipe_by_depth(1.6).dump(), rig), {});
  REQUIRE(run);
  CHECK(run->outcome == recipes::Outcome::failed);
  CHECK(run->cleanup == recipes::Cleanup::done);
  CHECK(run->rig == recipes::RigFact::safe);
  REQUIRE(run->error);
  CHECK(run->error->code == Errc::measurement);
}

TEST_CASE("a press with a taxel change over the cap fails the trial with the probe retracted") {
  json rig = wrenchless_rig();
  rig["limits"]["taxel_cap_counts"] = 60;
  const TemporaryFolder folder;
  const auto run = run_campaign(request_in(folder, recipe_by_depth(1.6).dump(), rig), {});
  REQUIRE(run);
  CHECK(run->outcome == recipes::Outcome::failed);
  CHECK(run->rig == recipes::RigFact::safe);
  REQUIRE(run->error);
  CHECK(run->error->code == Errc::safety);
}

TEST_CASE(
    "a press by depth on a plate that leans is refused where the path rises under the probe") {
  json rig = wrenchless_rig();
  drop(rig, "ry");
  rig["fixed"] = {{"ry_deg", 2}};
  const std::string along_weft = recipe_by_depth(1.6).dump();
  json across = json::parse(along_weft);
  across["explorations"].erase("M2");
  across["explorations"]["M1"]["phases"][2]["path"] = {{{"dx_mm", 6}, {"dy_mm", 0}}};
  const auto refused_at = [&](const std::string& recipe) {
    const TemporaryFolder folder;
    const auto run = run_campaign(request_in(folder, recipe, rig), {});
    return run ? std::string() : to_string(run.error());
  };
  CHECK_THAT(refused_at(across.dump()),
             Catch::Contains("/explorations/M1/phases/2/path") && Catch::Contains("0.05 mm"));
  rig["fixed"] = {{"ry_deg", 0}};
  CHECK_THAT(refused_at(across.dump()), !Catch::Contains("0.05 mm"));
}

TEST_CASE("taxels that repeat themselves on the way down stop z within the depth of a press") {
  json rig = wrenchless_rig();
  json& array = test::device_of(rig, "taxels");
  array["config"] = {{"rate_hz", 200}};
  array["emulator"] = {{"kind", "taxel"}, {"rows", 4}, {"cols", 4}, {"rate_hz", 200}};
  test::Guarded guarded(recipe_by_depth(1.6).dump(), rig);
  guarded.start();
  guarded.run_to(recipes::Step::approaching);
  guarded.bench.sim.loop.run_to(guarded.bench.sim.loop.now() + from_seconds(0.3));
  const auto z_now = [&] {
    return guarded.bench.sim.bench->snapshot().stage[recipes::index(recipes::Axis::z)].position;
  };
  const double frozen_at_m = z_now();
  REQUIRE(guarded.bench.sim.rig->inject(R"({"device":"taxels","fault":"frozen_frame"})",
                                        guarded.bench.sim.loop.now()));
  double deepest_m = frozen_at_m;
  while (!guarded.supervisor->result() &&
         guarded.bench.sim.loop.now() < TimePoint(from_seconds(600))) {
    guarded.bench.sim.loop.run_to(guarded.bench.sim.loop.now() + from_seconds(0.01));
    deepest_m = std::max(deepest_m, z_now());
  }
  REQUIRE(guarded.supervisor->result());
  CHECK(guarded.supervisor->result()->outcome == recipes::Outcome::failed);
  CHECK(deepest_m > frozen_at_m);
  CHECK(deepest_m - frozen_at_m < 2e-3);
}

TEST_CASE("without a force sensor counts that repeat themselves are never accepted") {
  json rig = wrenchless_rig();
  rig["limits"]["frozen_taxels_s"] = 0;
  const auto limits = recipes::parse_rig_limits(rig.dump());
  REQUIRE_FALSE(limits);
  CHECK_THAT(to_string(limits.error()), Catch::Contains("/limits/frozen_taxels_s"));
}

TEST_CASE("taxels that fall silent while the probe presses by depth end the campaign, probe up") {
  test::Guarded guarded(recipe_by_depth(1.6).dump(), wrenchless_rig());
  guarded.start();
  guarded.run_to(recipes::Step::holding);
  REQUIRE(guarded.bench.sim.rig->inject(R"({"device":"taxels","fault":"unplug"})",
                                        guarded.bench.sim.loop.now()));
  guarded.finish();
  const auto& done = *guarded.supervisor->result();
  CHECK(done.outcome == recipes::Outcome::failed);
  CHECK(done.cleanup == recipes::Cleanup::done);
  CHECK(done.rig == recipes::RigFact::safe);
  CHECK(guarded.bench.sim.rig->truth(guarded.bench.sim.loop.now()).contact_force_n == 0);
}

TEST_CASE("an array of 32 taxels at 100 Hz is recorded as it is") {
  json rig = test::bench17_near_home();
  json& array = test::device_of(rig, "taxels");
  array["config"] = {{"rows", 4}, {"cols", 8}, {"rate_hz", 100}};
  array["emulator"] = {{"kind", "taxel"}, {"rows", 4}, {"cols", 8}, {"rate_hz", 100}};
  const Dataset data = recorded(rig, short_recipe("denim"));
  const classifier::Trial& trial = data.trials.at(0);
  CHECK(trial.taxels == 32);
  // Phase P lasts 2 s.
  CHECK(std::ranges::count(trial.phase, Phase::press) == Approx(200).margin(2));
}

namespace {

/// The usual 16 taxels at 37 Hz, and six more at 50 Hz on their own port.
json two_array_rig() {
  json rig = test::bench17_near_home();
  json second = test::device_of(rig, "taxels");
  second["name"] = "fingertip";
  const json places{-6, 0, -4, 0, -2, 0, 2, 0, 4, 0, 6, 0};
  second["config"] = {{"taxels", 6}, {"positions_mm", places}, {"rate_hz", 50}};
  second["emulator"] = {{"kind", "taxel"}, {"positions_mm", places}, {"rate_hz", 50}};
  rig["devices"].push_back(second);
  return rig;
}

}  // namespace

TEST_CASE("two tactile arrays are one frame, with the taxels of the second behind the first's") {
  const Dataset data = recorded(two_array_rig(), short_recipe("denim"));
  const Dataset alone = recorded(test::bench17_near_home(), short_recipe("denim"));
  const classifier::Trial& trial = data.trials.at(0);
  const classifier::Trial& first = alone.trials.at(0);
  REQUIRE(trial.taxels == 22);
  REQUIRE(first.taxels == 16);
  REQUIRE(trial.phase.size() == first.phase.size());
  std::vector<double> of_first;
  for (std::size_t frame = 0; frame < trial.phase.size(); ++frame)
    for (std::size_t taxel = 0; taxel < 16; ++taxel)
      of_first.push_back(trial.counts[frame * 22 + taxel]);
  CHECK(of_first == first.counts);
  // The press shows in each taxel of the second array, which has the first array's level at rest.
  const auto mean_in = [&](Phase phase, std::size_t taxel) {
    double sum = 0, frames = 0;
    for (std::size_t frame = 0; frame < trial.phase.size(); ++frame)
      if (trial.phase[frame] == phase) {
        sum += trial.counts[frame * 22 + taxel];
        ++frames;
      }
    REQUIRE(frames > 0);
    return sum / frames;
  };
  for (std::size_t taxel = 16; taxel < 22; ++taxel) {
    INFO(taxel);
    CHECK(std::abs(mean_in(Phase::press, taxel) - mean_in(Phase::rest, taxel)) > 20);
  }
}

TEST_CASE("the second array's silence and its frozen counts end the campaign") {
  // The driver reports silence, the guard reports constant counts.
  const auto [fault, where] = GENERATE(
      table<std::string, std::string>({{"unplug", "fingertip"}, {"frozen_frame", "taxels"}}));
  test::Guarded guarded(short_recipe("denim"), two_array_rig());
  guarded.start();
  guarded.run_to(recipes::Step::holding);
  REQUIRE(guarded.bench.sim.rig->inject(json{{"device", "fingertip"}, {"fault", fault}}.dump(),
                                        guarded.bench.sim.loop.now()));
  guarded.finish();
  const auto& done = *guarded.supervisor->result();
  CHECK(done.outcome == recipes::Outcome::failed);
  CHECK(done.rig == recipes::RigFact::safe);
  REQUIRE(done.error);
  CHECK_THAT(to_string(*done.error), Catch::StartsWith(where));
}

TEST_CASE("an imprint array has no other array beside it") {
  json rig = two_array_rig();
  json& first = test::device_of(rig, "taxels");
  json& second = rig["devices"].back();
  second["config"] = {{"rows", 2}, {"cols", 3}};
  first["config"] = {{"rows", 16}, {"cols", 16}};
  for (json* imprints : {&first, &second}) {
    first["driver"] = second["driver"] = "taxel_array";
    (*imprints)["driver"] = "imprint_array";
    const auto limits = recipes::parse_rig_limits(rig.dump());
    REQUIRE_FALSE(limits);
    CHECK_THAT(to_string(limits.error()), Catch::Contains("/devices"));
  }
}

}  // namespace other_rigs_test
