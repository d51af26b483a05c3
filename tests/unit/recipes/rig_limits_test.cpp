#include <catch2/catch.hpp>

#include "tests/unit/recipes/bench.hpp"

namespace rig_limits_test {

using namespace weft::recipes;
using test::rig_json;
using test::with;

namespace {

std::string problems_of(const std::string& rig) {
  const weft::Result<RigLimits> limits = parse_rig_limits(rig);
  REQUIRE_FALSE(limits);
  return to_string(limits.error());
}

}  // namespace

TEST_CASE("A rig file is read in SI units") {
  const RigLimits limits = test::limits();
  CHECK(limits.bench == "simulated");
  CHECK(limits.max_speed_mps == 0.004);
  CHECK(limits.max_acceleration_mps2 == 0.02);
  CHECK(limits.geometry.travel[index(Axis::z)].max == 0.15);
  CHECK(limits.geometry.travel[index(Axis::rx)].max == Approx(0.0872664626));
  CHECK(limits.probe_weight_n == Approx(1.96133));
  CHECK(limits.clear_z_m() == Approx(0.092));
}

TEST_CASE("Sections of the rig file that belong to others are left alone") {
  CHECK(parse_rig_limits(with(rig_json, "\"level\": \"L1\"", "\"level\": 7, \"x\": [1, {}]")));
}

TEST_CASE("Every problem of a rig file is in the error, with its pointer") {
  std::string rig = with(rig_json, "\"bench\": \"simulated\"", "\"bench\": \"simulatd\"");
  rig = with(rig, "\"speed_mm_s\": 4", "\"speed\": 4");
  rig = with(rig, "\"x\": [0, 150]", "\"x\": [150, 0]");
  rig = with(rig, "\"mass_kg\": 0.2", "\"mass_kg\": -1");
  const std::string text = problems_of(rig);
  for (const char* part :
       {"/bench: ", "Did you mean simulated", "/limits/speed: ", "Did you mean speed_mm_s",
        "/limits/travel_mm/x: range empty", "/probe/mass_kg: number"})
    CHECK_THAT(text, Catch::Contains(part));
}

TEST_CASE("The park position is within the travel; an axis that is left out parks at home") {
  const auto rig = [](const std::string& park) {
    return with(rig_json, "\"control\"", "\"park\": " + park + ", \"control\"");
  };
  const auto limits = parse_rig_limits(rig(R"({"y_mm": 120, "rx_deg": -1})"));
  REQUIRE(limits);
  CHECK(limits->park[Axis::x] == 0);
  CHECK(limits->park[Axis::y] == Approx(0.12));
  CHECK(limits->park[Axis::rx] == Approx(-0.0174532925));
  CHECK_THAT(problems_of(rig(R"({"x_mm": 151, "z_mm": 3})")),
             Catch::Contains("/park/x_mm") && Catch::Contains("/park/z_mm"));
}

TEST_CASE("A misspelled limit is refused") {
  CHECK_THAT(
      problems_of(with(rig_json, "force_cap_N", "force_cpa_N")),
      Catch::Contains("key force_cap_N missing") && Catch::Contains("Did you mean force_cap_N"));
}

TEST_CASE("Limits that contradict each other are refused") {
  CHECK_THAT(problems_of(with(rig_json, "\"surface_z_mm\": 100", "\"surface_z_mm\": 160")),
             Catch::Contains("/plate/surface_z_mm: "));
  CHECK_THAT(problems_of(with(rig_json, "\"tilt_deg\": [-5, 5]", "\"tilt_deg\": [1, 5]")),
             Catch::Contains("/limits/tilt_deg: "));
  CHECK_THAT(problems_of(with(rig_json, "\"force_cap_N\": 10", "\"force_cap_N\": 1")),
             Catch::Contains("/limits/force_cap_N: "));
}

TEST_CASE("A travel without the home position in it, where every campaign begins, is refused") {
  for (const std::string axis : {"x", "y", "z"}) {
    const std::string range = "\"" + axis + "\": [0, 150]";
    for (const std::string ends : {"[5, 150]", "[-150, -5]"}) {
      const std::string text = problems_of(with(rig_json, range, "\"" + axis + "\": " + ends));
      CHECK_THAT(text, Catch::Contains("/limits/travel_mm/" + axis + ": travel excludes 0"));
      CHECK_THAT(text, Catch::Contains("contains 0"));
    }
    CHECK(parse_rig_limits(with(rig_json, range, "\"" + axis + "\": [-5, 150]")));
  }
}

TEST_CASE("Rates come from the drivers' configuration, that of the stages from the scan cycle") {
  CHECK(test::limits().wrench_rate_hz == 100);
  CHECK(test::limits().taxel_rate_hz == 37);
  CHECK(test::limits().stage_rate_hz() == 20);
  const std::string rig = with(
      with(
          rig_json, "\"devices\": []",
          R"("devices": [{"role": "wrench", "config": {"rate_hz": 500, "rated_force_n": [1, 1, 1]}},
              {"role": "taxels", "config": {"rate_hz": 50, "taxels": 8}}, {"role": 7, "config": 1}])"),
      "\"cycle_hz\": 100", "\"cycle_hz\": 250");
  const weft::Result<RigLimits> limits = parse_rig_limits(rig);
  REQUIRE(limits);
  CHECK(limits->wrench_rate_hz == 500);
  CHECK(limits->taxel_rate_hz == 50);
  CHECK(limits->taxels == 8);
  CHECK(limits->slowest_taxel_rate_hz() == 50);
  const auto two = parse_rig_limits(with(
      rig, R"({"role": 7,)",
      R"({"name": "b", "role": "taxels", "driver": "taxel_array", "config": {"rate_hz": 40, "rows": 2, "cols": 3}}, {"role": 7,)"));
  if (!two) FAIL(weft::to_string(two.error()));
  CHECK(two->taxel_rate_hz == 50);
  CHECK(two->slowest_taxel_rate_hz() == 40);
  CHECK(two->stream_rate_hz("taxels", "b") == 40);
  CHECK(two->taxels == 14);
  CHECK(limits->stage_rate_hz() == 50);
  CHECK_THAT(problems_of(with(rig, "\"rate_hz\": 500", "\"rate_hz\": -1")),
             Catch::Contains("/devices/0/config/rate_hz"));
  CHECK_THAT(problems_of(with(rig, "\"rate_hz\": 500", "\"rate_hz\": 19")),
             Catch::Contains("/devices/0/config/rate_hz") && Catch::Contains("force control"));
  CHECK(parse_rig_limits(with(rig, "\"rate_hz\": 500", "\"rate_hz\": 20")));
}

TEST_CASE("A rig file that is not JSON is refused with line and column") {
  CHECK_THAT(problems_of("{\"name\": }"), Catch::Contains("line 1, column 10"));
}

namespace {

/// The bench without some stages: `fixed` has the positions of their axes.
std::string rig_without(const std::string& fixed, bool without_y) {
  std::string rig = with(rig_json, "\"control\"", "\"fixed\": " + fixed + ", \"control\"");
  rig = with(rig, ", \"tilt_deg\": [-5, 5]", "");
  return without_y ? with(rig, "\"y\": [0, 150], ", "") : rig;
}

}  // namespace

TEST_CASE("A fixed axis has the position of the rig file and no travel") {
  const auto limits = parse_rig_limits(rig_without(R"({"rx_deg": 0, "ry_deg": 1})", false));
  REQUIRE(limits);
  CHECK(limits->geometry.is_fixed(Axis::rx));
  CHECK(limits->geometry.is_fixed(Axis::ry));
  CHECK_FALSE(limits->geometry.is_fixed(Axis::y));
  CHECK(limits->level.ry_rad == Approx(0.0174532925));
  CHECK(limits->park[Axis::ry] == limits->level.ry_rad);
  const auto xz = parse_rig_limits(rig_without(R"({"y_mm": 75, "rx_deg": 0, "ry_deg": 0})", true));
  REQUIRE(xz);
  CHECK(xz->geometry.travel[index(Axis::y)].min == Approx(0.075));
  CHECK(xz->geometry.travel[index(Axis::y)].width() == 0);
}

TEST_CASE(
    "A fixed axis with a travel, a fixed x or z, and a level that it cannot take are refused") {
  const std::string zeros = R"({"rx_deg": 0, "ry_deg": 0})";
  CHECK_THAT(problems_of(rig_without(R"({"y_mm": 75, "rx_deg": 0, "ry_deg": 0})", false)),
             Catch::Contains("/limits/travel_mm/y"));
  CHECK_THAT(
      problems_of(rig_without(R"({"x_mm": 75, "rx_deg": 0, "ry_deg": 0, "rz_deg": 1})", false)),
      Catch::Contains("/fixed/x_mm") && Catch::Contains("/fixed/rz_deg"));
  CHECK_THAT(problems_of(with(rig_without(zeros, false), "\"surface_z_mm\"",
                              "\"level\": {\"rx_deg\": 1, \"ry_deg\": 0}, \"surface_z_mm\"")),
             Catch::Contains("/plate/level/rx_deg"));
}

}  // namespace rig_limits_test
