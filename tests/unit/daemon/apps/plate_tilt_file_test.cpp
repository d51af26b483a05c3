// The plate's tilt from an alignment to a campaign.

#include "daemon/hardware/rig/rig_file.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/apps/weft/commands.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "protocols/base/time.hpp"
#include "recipes/engine/rig_limits.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace level_file_test {

using namespace weft;
using namespace weft::daemon;
using namespace std::chrono_literals;
using nlohmann::json;

namespace {

constexpr std::int64_t measured_s = 1'795'000'000;

json found_level() {
  return {{"command", "align"},
          {"rig", "bench17"},
          {"bench", "simulated"},
          {"outcome", "complete"},
          {"tolerance_rad", 1e-4},
          {"measured_unix_s", measured_s},
          {"after", {{"rx_rad", -0.02}, {"ry_rad", 0.015}, {"lean_rad", 2e-5}}}};
}

Result<std::string> merged(const json& level, std::int64_t age_s = 60,
                           std::chrono::seconds oldest = 24h) {
  return with_level(test::bench17().dump(), level.dump(), std::chrono::seconds(measured_s + age_s),
                    oldest);
}

Error refused(const json& level, std::int64_t age_s = 60) {
  const auto text = merged(level, age_s);
  REQUIRE_FALSE(text);
  return text.error();
}

/// The largest distance of a rotary axis from `angle_rad` in recorded phases [rad].
double farthest_rad(const Dataset& data, const std::string& axis, double angle_rad) {
  const auto& axes = data.info.axes;
  const auto found = std::ranges::find(axes, axis, &Axis::name);
  REQUIRE(found != axes.end());
  const auto column = static_cast<std::size_t>(found - axes.begin());
  double farthest = 0;
  std::size_t rows = 0;
  for (const TrialRecord& record : data.records)
    for (std::size_t i = 0; i < record.stages.samples(); ++i) {
      const std::int64_t t_ns = record.stages.t_ns[i];
      if (t_ns < record.t_ns.front() || t_ns > record.t_ns.back()) continue;
      ++rows;
      const double at_rad =
          record.stages.quanta[i * axes.size() + column] / found->quanta_per_unit();
      farthest = std::max(farthest, std::abs(at_rad - angle_rad));
    }
  CHECK(rows > 100);  // two trials of some seconds at 20 Hz
  return farthest;
}

json changed(const char* pointer, const json& value) {
  json level = found_level();
  level[json::json_pointer(pointer)] = value;
  return level;
}

}  // namespace

TEST_CASE("a level that was found goes into the rig file, with when and how well") {
  const auto text = merged(found_level());
  REQUIRE(text);
  const json level = json::parse(*text)["plate"]["level"];
  CHECK(level["measured_unix_s"] == measured_s);
  CHECK(level["lean_left_rad"] == 2e-5);
  const auto limits = recipes::parse_rig_limits(*text);
  REQUIRE(limits);
  CHECK(limits->level.rx_rad == -0.02);
  CHECK(limits->level.ry_rad == 0.015);
  CHECK(limits->clear_z_m() < recipes::parse_rig_limits(test::bench17().dump())->clear_z_m());
  CHECK(merged(found_level(), 1'000'000, 0s));   // any age
  CHECK(merged(found_level(), -1'000'000, 0s));  // the clock was set back meanwhile
}

TEST_CASE("a level of another rig, of another bench, of long ago or of no success is refused") {
  CHECK(refused(json::array()).code == Errc::parse);
  CHECK(refused({{"command", "align"}}).code == Errc::parse);
  CHECK(refused(changed("/after/rx_rad", "0.1")).code == Errc::parse);
  CHECK(refused(changed("/after", nullptr)).where == "/after");
  CHECK(refused(changed("/rig", "bench18")).where == "/rig");
  CHECK(refused(changed("/rig", "bench18")).got == "bench18");
  CHECK(refused(changed("/bench", "real")).where == "/bench");
  CHECK(refused(changed("/bench", "real")).got == "real");
  CHECK(refused(changed("/outcome", "failed")).where == "/outcome");
  CHECK(refused(changed("/after/lean_rad", 1)).where == "/outcome");
  const auto check_time = [](const Error& error, const std::string& limit) {
    CHECK(error.where == "/measured_unix_s");
    CHECK(error.expected.starts_with(limit));  // at least: too old; at most: in the future
  };
  check_time(refused(found_level(), 25 * 3600), "at least");
  check_time(refused(found_level(), -3600), "at most");
  using Limit = std::numeric_limits<std::int64_t>;
  check_time(refused(changed("/measured_unix_s", Limit::min())), "at least");
  check_time(refused(changed("/measured_unix_s", Limit::max())), "at most");
  const auto twice = with_level(*merged(found_level()), found_level().dump(),
                                std::chrono::seconds(measured_s), 24h);
  CHECK(twice.error().where == "/plate/level");
}

TEST_CASE("angles that the rotary stages do not reach are refused where the rig file is read") {
  const auto steep = merged(changed("/after/ry_rad", 0.2));  // 11 degrees, of a travel of 5
  REQUIRE(steep);
  const auto limits = recipes::parse_rig_limits(*steep);
  REQUIRE_FALSE(limits);
  CHECK(to_string(limits.error()).find("/plate/level/ry_rad") != std::string::npos);
}

TEST_CASE("a campaign on a plate askew runs at the level that weft align found, and records it") {
  const test::TemporaryFolder folder;
  json rig = test::bench17();
  rig["simulation"]["plate_tilt_deg"] = {1.2, -0.9};
  auto request = test::request_in(folder, test::short_recipe("denim"), rig);
  std::ostringstream reply, complained;
  const std::string rig_path = request.rig.string();
  const char* argv[] = {"weft", "align", "--rig", rig_path.c_str(), "--json"};
  cli::Console console{reply, complained};
  REQUIRE(cli::run(5, argv, console) == 0);
  request.level = folder / "level.json";
  test::write_file(request.level, reply.str());
  request.error_check = false;
  const auto summary = run_campaign(request, {});
  if (!summary) FAIL(to_string(summary.error()));
  REQUIRE(summary->outcome == recipes::Outcome::complete);
  CHECK(summary->force.in_band == summary->force.samples);
  const Dataset data = read_hdf5(summary->dataset_file).value();
  const json level = json::parse(data.info.rig_json)["plate"]["level"];
  CHECK(level["rx_rad"].get<double>() == Approx(-1.2 * rad_per_deg).margin(2e-4));
  CHECK(level["ry_rad"].get<double>() == Approx(-0.9 * rad_per_deg).margin(2e-4));
  constexpr double stage_step_rad = 1e-5;  // step of the rotary stages' counts
  CHECK(farthest_rad(data, "rx", level["rx_rad"]) < stage_step_rad);
  CHECK(farthest_rad(data, "ry", level["ry_rad"]) < stage_step_rad);
}

}  // namespace level_file_test
