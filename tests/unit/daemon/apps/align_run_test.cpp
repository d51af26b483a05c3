#include "daemon/campaign/align_run.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "daemon/apps/weft/commands.hpp"
#include "protocols/base/time.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace align_run_test {

using namespace weft;
using namespace weft::daemon;
using weft::daemon::test::TemporaryFolder;

namespace {

using nlohmann::json;

/// bench17 with a tilted plate, in its own file. The face is rigid: a soft cover blurs the height
/// of first contact.
std::filesystem::path askew_rig(const TemporaryFolder& folder, double x_deg, double y_deg,
                                const json& faults = json::array()) {
  json rig = test::bench17();
  rig["simulation"]["plate_tilt_deg"] = {x_deg, y_deg};
  rig["simulation"]["faults"] = faults;
  rig["simulation"]["cover_um"] = 0;
  test::write_file(folder / "askew.json", rig.dump());
  return folder / "askew.json";
}

AlignSummary aligned(const AlignRequest& request) {
  const auto summary = run_alignment(request);
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

/// Angle between the probe's axis in the final stage position and the normal of the rig file's
/// plate, turned with the platform. Computed by rotation, not from contact readings.
double true_lean_rad(const recipes::Tilts& stages, double x_deg, double y_deg) {
  const double tx = x_deg * rad_per_deg + stages.rx_rad, ty = y_deg * rad_per_deg;
  const recipes::Direction plate{-std::sin(ty), -std::cos(ty) * std::sin(tx),
                                 std::cos(ty) * std::cos(tx)};
  const recipes::Direction probe{-std::sin(stages.ry_rad), 0, std::cos(stages.ry_rad)};
  return recipes::angle_between(plate, probe);
}

// Contact readings have steps of 1 um: over 100 mm that is 10 urad about each axis.
constexpr double micrometre_over_span_rad = 1e-6 / 0.1;

}  // namespace

TEST_CASE("Simulated plates within 2 degrees are levelled to what 1 um over the span allows") {
  const TemporaryFolder folder;
  std::mt19937 random(20161122);
  std::uniform_real_distribution<double> degrees(-2, 2);
  double worst_rad = 0;
  for (int i = 0; i < 12; ++i) {
    const double x_deg = degrees(random), y_deg = degrees(random);
    AlignRequest request;
    request.rig = askew_rig(folder, x_deg, y_deg);
    const AlignSummary s = aligned(request);
    CAPTURE(x_deg, y_deg);
    REQUIRE(s.done.outcome == recipes::Outcome::complete);
    REQUIRE(s.rounds.size() == 2);
    const recipes::TiltFound& before = s.rounds.front();
    REQUIRE(std::abs(before.tilt_x_rad - x_deg * rad_per_deg) < micrometre_over_span_rad);
    REQUIRE(std::abs(before.tilt_y_rad - y_deg * rad_per_deg) < micrometre_over_span_rad);
    REQUIRE(before.plane.residual_worst_m < 2e-6);
    REQUIRE(s.rounds.back().lean_rad < 2 * micrometre_over_span_rad);
    worst_rad = std::max(worst_rad, true_lean_rad(s.rounds.back().stages, x_deg, y_deg));
  }
  WARN("SIMULATED: worst tilt left " << worst_rad * 1e6 << " urad of the true plate, 12 plates");
  CHECK(worst_rad < std::sqrt(2.0) * micrometre_over_span_rad);
}

TEST_CASE("An alignment that finds no plate, or measures too much force, fails with its reason") {
  const TemporaryFolder folder;
  AlignRequest narrow;
  narrow.rig = askew_rig(folder, 6, 0);
  narrow.settings.largest_tilt_rad = 1 * rad_per_deg;
  const AlignSummary lost = aligned(narrow);
  CHECK(lost.done.outcome == recipes::Outcome::failed);
  CHECK(lost.done.cleanup == recipes::Cleanup::done);
  REQUIRE(lost.done.error);
  CHECK(lost.done.error->code == Errc::measurement);

  AlignRequest with_fault;
  with_fault.rig = askew_rig(
      folder, 1, 1, {{{"device", "ft"}, {"fault", "bias_jump"}, {"start_s", 120}, {"amount", 50}}});
  const AlignSummary capped = aligned(with_fault);
  CHECK(capped.done.outcome == recipes::Outcome::failed);
  REQUIRE(capped.done.error);
  CHECK(capped.done.error->code == Errc::safety);
}

TEST_CASE("An alignment with a failed z stage ends with its fault, not with the retract timer") {
  const TemporaryFolder folder;
  constexpr double fails_s = 130;  // during the contacts
  AlignRequest request;
  request.rig = askew_rig(
      folder, 1, 1, {{{"device", "stage.z"}, {"fault", "over_temperature"}, {"start_s", fails_s}}});
  const AlignSummary summary = aligned(request);
  CHECK(summary.done.outcome == recipes::Outcome::failed);
  CHECK(summary.done.cleanup == recipes::Cleanup::failed);
  CHECK(summary.done.rig == recipes::RigFact::unknown);
  REQUIRE(summary.done.error);
  CHECK_THAT(summary.done.error->where, Catch::StartsWith("stage.z"));
  CHECK(summary.bench_s > fails_s);
  CHECK(summary.bench_s < fails_s + 3);
}

TEST_CASE("An alignment on stages that accelerate slowly is no following error") {
  const TemporaryFolder folder;
  const auto file = askew_rig(folder, 0.5, -0.5);
  json rig = json::parse(test::read_file(file));
  rig["limits"]["acceleration_mm_s2"] = 4;
  for (const char* role : {"x", "y", "z"})
    test::device_of(rig, role)["config"].erase("acceleration_mm_s2");
  test::write_file(file, rig.dump());
  AlignRequest request;
  request.rig = file;
  CHECK(aligned(request).done.outcome == recipes::Outcome::complete);
}

TEST_CASE("An alignment under a cap of less than two weights of its probe feels no jump") {
  const TemporaryFolder folder;
  for (int seed = 1; seed <= 4; ++seed) {
    CAPTURE(seed);
    AlignRequest request;
    request.rig = askew_rig(folder, 0.1 * seed, -0.07 * seed);
    request.seed = static_cast<std::uint64_t>(seed);
    json rig = json::parse(test::read_file(request.rig));
    rig["limits"]["force_cap_N"] = 3.2;
    test::write_file(request.rig, rig.dump());
    CHECK(aligned(request).done.outcome == recipes::Outcome::complete);
  }
}

TEST_CASE("weft align prints the tilt found and left, marked as simulated") {
  const TemporaryFolder folder;
  const std::string rig = askew_rig(folder, 0.5, -0.25).string();
  std::ostringstream out, err;
  cli::Console console{out, err};
  const char* arguments[] = {"weft", "align", "--rig", rig.c_str(), "--points", "2"};
  CHECK(cli::run(6, arguments, console) == cli::exit_ok);
  CHECK_THAT(out.str(), Catch::StartsWith("SIMULATED") && Catch::Contains("remaining tilt"));
  const std::string row = "measured tilt";
  const auto at = out.str().find(row);
  REQUIRE(at != std::string::npos);
  std::istringstream reported(out.str().substr(at + row.size()));
  double about_x_deg = 0, about_y_deg = 0;
  reported >> about_x_deg >> about_y_deg;
  constexpr double thrice_the_deviation_deg = 0.0007;  // for two contacts over 100 mm
  CHECK(about_x_deg == Approx(0.5).margin(thrice_the_deviation_deg));
  CHECK(about_y_deg == Approx(-0.25).margin(thrice_the_deviation_deg));
  CHECK(err.str().empty());
}

}  // namespace align_run_test
