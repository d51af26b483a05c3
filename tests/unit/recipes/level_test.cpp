// Campaigns on a rig with rotary stages that are held where the plate is level.

#include <catch2/catch.hpp>
#include <cmath>

#include "recipes/engine/motion.hpp"
#include "tests/unit/recipes/bench.hpp"
#include "tests/unit/recipes/bench_geometry.hpp"

namespace level_test {

using namespace weft::recipes;
using test::rig_json;

namespace {

RigLimits levelled(double rx_rad, double ry_rad) {
  RigLimits limits;
  limits.geometry = test::bench_geometry();
  limits.level = {rx_rad, ry_rad};
  return limits;
}

Plan one_leg(const RigLimits& limits) {
  Plan plan;
  plan.limits = limits;
  return plan;
}

double target(const std::vector<AxisMove>& moves, Axis axis) {
  for (const AxisMove& move : moves)
    if (move.axis == axis) return move.target;
  FAIL("no move of the axis");
  return 0;
}

std::string with_level(const std::string& level) {
  return test::with(rig_json, "\"plate\": {", "\"plate\": {\"level\": " + level + ", ");
}

}  // namespace

TEST_CASE("with a level the rotary stages are held there and the face stays over its point") {
  const RigLimits limits = levelled(0.02, -0.015);
  const Vec2 point{0.04, 0.07};
  const Joints joints = over(limits, point, 0).value();
  CHECK(joints[Axis::rx] == 0.02);
  CHECK(joints[Axis::ry] == -0.015);
  const ProbePose pose = forward(limits.geometry, joints);
  CHECK(pose.contact_m.x_m == Approx(point.x_m).margin(1e-12));
  CHECK(pose.contact_m.y_m == Approx(point.y_m).margin(1e-12));
  // The probe turns about an axis 50 mm over its face.
  CHECK(joints[Axis::x] == Approx(0.04 + 0.01 + 0.05 * std::sin(0.015)).margin(1e-12));
}

TEST_CASE("a leg ends where a transfer to its end would have put the stages, level or not") {
  for (const RigLimits& limits : {levelled(0, 0), levelled(0.02, -0.015)}) {
    const PathLeg leg{{0.03, 0.03}, {0.05, 0.06}, std::hypot(0.02, 0.03)};
    const auto moves = leg_moves(one_leg(limits), leg, 0.001).value();
    const Joints there = over(limits, leg.to_m, limits.clearance_m).value();
    CHECK(target(moves, Axis::x) == Approx(there[Axis::x]).margin(1e-12));
    CHECK(target(moves, Axis::y) == Approx(there[Axis::y]).margin(1e-12));
  }
}

TEST_CASE(
    "a transfer to a start brings the rotary stages to the level, and the face over its point") {
  Exploration exploration;
  exploration.start_m = {0.04, 0.07};
  for (const RigLimits& limits : {levelled(0, 0), levelled(0.02, -0.015)}) {
    Plan plan = one_leg(limits);
    plan.explorations = {exploration};
    const Joints above = above_start(plan, TrialSpec{}).value();
    const auto moves = transfer(plan, above);
    CHECK(target(moves, Axis::rx) == limits.level.rx_rad);
    CHECK(target(moves, Axis::ry) == limits.level.ry_rad);
    Joints there = above;
    for (const AxisMove& move : moves) there[move.axis] = move.target;
    const ProbePose pose = forward(limits.geometry, there);
    CHECK(pose.contact_m.x_m == Approx(0.04).margin(1e-12));
    CHECK(pose.contact_m.y_m == Approx(0.07).margin(1e-12));
  }
}

TEST_CASE(
    "a plate that leans with the probe is cleared at its higher edge and sought at its lower") {
  const RigLimits flat = levelled(0.02, 0), leaning = levelled(0.02, -0.015);
  CHECK(flat.level_rise_m() == 0);
  const double rise_m = 0.06 * std::tan(0.015);
  CHECK(leaning.clear_z_m() == Approx(flat.clear_z_m() - rise_m));
  CHECK(lowest_z_m(leaning) == Approx(lowest_z_m(flat) + rise_m));
}

namespace {

/// Checks a path of 50 mm along each direction from a start [mm].
CheckReport checked_from(const RigLimits& limits, double x_mm, double y_mm) {
  const std::string start = "\"M2\": {\"start\": {\"x_mm\": " + std::to_string(x_mm) +
                            ", \"y_mm\": " + std::to_string(y_mm) + "}, ";
  return check_recipe(test::small_with("\"M2\": {", start), limits);
}

}  // namespace

TEST_CASE("a path that the level takes beyond a stage's travel is refused by the check") {
  RigLimits limits = levelled(0, 0);
  limits.geometry.plate_size_m = {0.14, 0.12};
  REQUIRE(checked_from(limits, 82, 50).plan);
  limits.level = {0, -0.2};  // the arm of 50 mm moves x by another 10 mm
  const CheckReport far = checked_from(limits, 82, 50);
  REQUIRE(far.problems.size() == 1);
  CHECK(far.problems[0].pointer == "/explorations/M2/phases/2/path");
  CHECK_THAT(far.problems[0].message, Catch::Contains("along x"));
  CHECK(checked_from(limits, 72, 50).plan);
}

TEST_CASE("a path along which the level takes z beyond its travel is refused by the check") {
  RigLimits limits = levelled(0.15, 0);
  REQUIRE(checked_from(limits, 30, 20).plan);
  limits.geometry.travel[index(Axis::z)].max = 0.094;  // 92 mm over the middle of the plate
  const CheckReport low = checked_from(limits, 30, 20);
  REQUIRE(low.problems.size() == 1);
  CHECK(low.problems[0].pointer == "/explorations/M2/phases/2/path");
  CHECK_THAT(low.problems[0].message, Catch::Contains(" z "));
  CHECK(checked_from(limits, 30, 55).plan);
}

TEST_CASE("a start exactly at the end of travel can be gone to, whatever binary makes of its sum") {
  RigLimits limits = levelled(0, 0);  // 10 mm and 140 mm are 1e-17 m more than 150 mm
  limits.geometry.plate_size_m.x_m = 0.15;
  limits.footprint_m = {1e-3, 1e-3};
  const CheckReport report =
      check_recipe(test::with(test::small_with("\"dx_mm\": 50", "\"dx_mm\": -50"), "\"M2\": {",
                              "\"M2\": {\"start\": {\"x_mm\": 140, \"y_mm\": 50}, "),
                   limits);
  REQUIRE(report.plan);
  CHECK(above_start(*report.plan, report.plan->trials.front()));
}

TEST_CASE(
    "a height exactly at the end of travel is let pass, and one finding is enough for a path") {
  RigLimits limits = levelled(0, 0);  // 8 mm, 10 mm and back are 1e-18 m less than 0
  limits.geometry.surface_z_m = limits.clearance_m = 0.008;
  limits.geometry.tilt_axis_depth_m = 0.01;
  limits.geometry.probe_arm_m = 0;
  REQUIRE(over(limits, {0.03, 0.03}, 0.008));
  REQUIRE((*over(limits, {0.03, 0.03}, 0.008))[Axis::z] < 0);
  CHECK(checked_from(limits, 30, 20).plan);
  limits = levelled(0.15, 0);
  limits.geometry.travel[index(Axis::z)].max = 0.094;
  const CheckReport far = checked_from(limits, 30, 1000);
  REQUIRE(far.problems.size() == 1);
  CHECK_THAT(far.problems[0].message, Catch::Contains("along y"));
}

TEST_CASE("what the check lets pass with a level the engine can command, to the ends of travel") {
  for (const Tilts level : {Tilts{0, 0}, {0.02, -0.015}, {-0.1, 0.2}, {0.25, -0.25}}) {
    RigLimits limits = levelled(level.rx_rad, level.ry_rad);
    limits.footprint_m = {1e-3, 1e-3};
    int passed = 0, refused = 0;
    for (double x_mm = 0; x_mm <= 70; x_mm += 5)
      for (double y_mm = 0; y_mm <= 70; y_mm += 5) {
        const CheckReport report = checked_from(limits, x_mm, y_mm);
        ++(report.plan ? passed : refused);
        if (!report.plan) continue;
        const Exploration& exploration = report.plan->explorations.front();
        REQUIRE(above_start(*report.plan, report.plan->trials.front()));
        for (std::size_t leg = 0; leg < exploration.path_m().size(); ++leg)
          REQUIRE(leg_moves(*report.plan, path_leg(exploration, leg), 1e-3));
      }
    CHECK(passed > 0);
    CHECK(refused > 0);
  }
}

TEST_CASE("a level in the rig file is read in degrees or radians, strictly and within the travel") {
  const auto limits = parse_rig_limits(with_level(R"({"rx_deg": 1, "ry_rad": -0.01})"));
  REQUIRE(limits);
  CHECK(limits->level.rx_rad == Approx(0.0174532925));
  CHECK(limits->level.ry_rad == -0.01);
  CHECK(limits->levelled());
  for (const char* wrong : {R"({"rx_deg": 6, "ry_deg": 0})", R"({"rx_deg": 1})", "[1, 2]",
                            R"({"rx_deg": 0, "ry_deg": 0, "rz_deg": 0})"}) {
    INFO(wrong);
    const auto refused = parse_rig_limits(with_level(wrong));
    REQUIRE_FALSE(refused);
    CHECK(to_string(refused.error()).find("/plate/level") != std::string::npos);
  }
}

}  // namespace level_test
