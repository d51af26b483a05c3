// The emulated imprint array: it sends the press of the object under the bench's force.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <numeric>

#include "protocols/imprint/imprint.hpp"
#include "sim/plant/imprint/objects.hpp"
#include "sim/rig/rig_config.hpp"
#include "tests/unit/sim/support.hpp"
#include "tests/unit/source_text.hpp"

namespace imprint_emulator_test {

using namespace weft;
using namespace weft::sim;
namespace imprint = protocols::imprint;
using nlohmann::json;

namespace {

/// The imprint bench, with changed members of the array's emulator.
json imprint_bench(const std::string& emulator = "{}") {
  json rig = json::parse(testing::source_text("sim/rigs/imprint12.json"));
  for (json& device : rig["devices"])
    if (device["role"] == "taxels") device["emulator"].update(json::parse(emulator));
  return rig;
}

/// A rig with the z stage at a height with some contact force, and the array's link.
struct Bench {
  explicit Bench(const json& rig_json, std::uint64_t seed = 4) : link(loop) {
    auto made = Rig::create(rig_json.dump(), testing::source_text("sim/objects.json"), seed);
    if (!made) FAIL(to_string(made.error()));
    rig = std::move(*made);
    REQUIRE(rig->attach("imprint", link, loop));
  }
  std::vector<imprint::Frame> frames(imprint::Kind kind) {
    return test::frames_of<imprint::Splitter, imprint::Frame>(link, kind);
  }
  void query(const imprint::Window& window) {
    imprint::Frame request;
    request.kind = imprint::Kind::request;
    request.window = window;
    Bytes bytes;
    append(bytes, request);
    link.send(bytes);
  }
  imprint::Frame last_scan(double seconds = 0.5) {
    link.pieces.clear();
    loop.run_for(seconds);
    const auto scans = frames(imprint::Kind::scan);
    REQUIRE_FALSE(scans.empty());
    return scans.back();
  }

  test::TestLoop loop;
  std::unique_ptr<Rig> rig;
  test::TestLink link;
};

/// The stage is deep enough in an object of 2 mm to press it.
json pressing(json rig, double depth_mm) {
  for (json& device : rig["devices"])
    if (device["role"] == "z") device["emulator"]["start_mm"] = 58 + depth_mm;
  return rig;
}

double compute_mean(const imprint::Frame& scan) {
  const auto taxels = scan.taxels();
  return std::accumulate(taxels.begin(), taxels.end(), 0.0) / static_cast<double>(taxels.size());
}

double empty_share(const imprint::Frame& scan) {
  const auto taxels = scan.taxels();
  return static_cast<double>(std::ranges::count(taxels, 0)) / static_cast<double>(taxels.size());
}

std::string refusal(const json& rig) {
  const auto config = parse_rig_config(rig.dump());
  REQUIRE_FALSE(config);
  return to_string(config.error());
}

}  // namespace

TEST_CASE("an imprint array sends its description each second, and scans the requested part") {
  Bench bench(imprint_bench());
  bench.loop.run_for(1.1);
  const auto reported = bench.frames(imprint::Kind::description);
  REQUIRE(reported.size() == 2);
  CHECK(reported[0].description.rows == 128);
  CHECK(reported[0].description.cols == 128);
  CHECK(reported[0].description.bits == 7);
  CHECK(reported[0].description.spacing_um == 280);
  CHECK(reported[0].description.full_scale_pa == 150000);
  CHECK(reported[0].description.period_us == 200000);
  const auto scans = bench.frames(imprint::Kind::scan);
  REQUIRE(scans.size() == 5);
  CHECK(scans[4].sequence == 4);
  CHECK(scans[4].device_us == 1000000);
  CHECK(scans[4].window == imprint::Window{0, 0, 128, 128});
  CHECK(compute_mean(scans[4]) < 1);  // no load
  bench.query({48, 40, 32, 16});
  CHECK(bench.last_scan().window == imprint::Window{48, 40, 32, 16});
}

TEST_CASE("an imprint is the pressure of the bench's force, and keeps its object's face") {
  const auto scan_of = [](const char* object, double depth_mm, const char* level) {
    Bench bench(pressing(
        imprint_bench(std::string(R"({"noise_counts": 0, "level": ")") + level + "\"}"), depth_mm));
    REQUIRE(bench.rig->mount(object, 5, bench.loop.now()));
    const imprint::Frame scan = bench.last_scan(1);
    const double force_n = bench.rig->truth(bench.loop.now()).contact_force_n;
    return std::pair{scan, force_n};
  };
  for (const char* level : {"Z", "Z+"}) {
    INFO(level);
    const auto [plane, plane_n] = scan_of("PLANE2", 2.0, level);
    CHECK(plane_n > 10);
    // A plane at 20 N saturates no taxel, so the counts give the force.
    const double area_m2 = array_side * array_side * taxel_spacing_m * taxel_spacing_m;
    const double reported_n = compute_mean(plane) / 127 * 150e3 * area_m2;
    CHECK(reported_n == Approx(plane_n).epsilon(level[1] == '+' ? 0.1 : 0.02));
    const auto [rasp, rasp_n] = scan_of("RASP1", 2.0, level);
    CHECK(empty_share(rasp) > 0.5);  // teeth with gaps between them
    CHECK(empty_share(plane) < 0.5);
    const auto [heavy, heavy_n] = scan_of("RASP1", 3.4, level);
    CHECK(heavy_n > 1.5 * rasp_n);
    CHECK(compute_mean(heavy) > compute_mean(rasp));
  }
}

TEST_CASE("the same object laid on anew gives another imprint, the same seed the same bytes") {
  const auto bytes = [](std::uint64_t patch) {
    Bench bench(pressing(imprint_bench(), 2.0));
    REQUIRE(bench.rig->mount("SCREEN2", patch, bench.loop.now()));
    bench.loop.run_for(1);
    return bench.link.received;
  };
  CHECK(bytes(1) == bytes(1));
  CHECK(bytes(1) != bytes(2));
}

TEST_CASE("an imprint array's emulator is read strictly") {
  CHECK(refusal(imprint_bench(R"({"level": "L1"})")).find("/devices/6/emulator/level") !=
        std::string::npos);
  CHECK(refusal(imprint_bench(R"({"level": "Q"})")).find("Z or Z+") != std::string::npos);
  CHECK(refusal(imprint_bench(R"({"bits": 8})")).find("/bits") != std::string::npos);
  CHECK(refusal(imprint_bench(R"({"taxels": 8})")).find("/taxels") != std::string::npos);
}

}  // namespace imprint_emulator_test
