// Rigs that differ from the 5-DoF bench: axes without a stage.

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/campaign/align_run.hpp"
#include "daemon/campaign/maintenance.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "recipes/alignment/align_plan.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace other_rigs_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::request_in;
using test::short_recipe;
using test::TemporaryFolder;

namespace {

/// bench17 without these stages; `fixed` says where their axes stand.
json rig_without(const std::vector<std::string>& roles, const json& fixed) {
  json rig = test::bench17_near_home();
  rig["fixed"] = fixed;
  for (const std::string& role : roles) {
    json& devices = rig["devices"];
    devices.erase(std::ranges::find(devices, role, [](const json& d) { return d["role"]; }));
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

/// Slides along x alone.
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

/// Of the recorded positions of an axis [m] or [rad], by its place in x, y, z, rx, ry.
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
  CHECK_THAT(to_string(slides_in_y.error()), Catch::Contains("/explorations/M1/phases/2/path") &&
                                                 Catch::Contains("no stage along it"));
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

}  // namespace other_rigs_test
