#include "recipes/kinematics/kinematics.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "tests/unit/recipes/bench_geometry.hpp"

namespace surface_pose_test {

using namespace weft;
using namespace weft::recipes;
using test::bench_geometry;
using test::joints_anywhere;

namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

Direction minus(const Direction& a, const Direction& b) {
  return {a.u - b.u, a.v - b.v, a.up - b.up};
}

double norm(const Direction& d) {
  return std::sqrt(d.u * d.u + d.v * d.v + d.up * d.up);
}

}  // namespace

TEST_CASE("Stage positions come back from point and normal to 1e-12, over the whole travel") {
  const Geometry g = bench_geometry();
  std::mt19937 random(11);
  for (int i = 0; i < 2000; ++i) {
    const Joints joints = joints_anywhere(g, random);
    const auto pose = surface_pose(g, joints);
    REQUIRE(pose);
    const auto back = joints_on(g, *pose);
    REQUIRE(back);
    for (const Axis axis : all_axes) REQUIRE(std::abs((*back)[axis] - joints[axis]) < 1e-12);
  }
}

TEST_CASE(
    "Point and normal come back from stage positions to 1e-12, whatever the normal's length") {
  const Geometry g = bench_geometry();
  std::mt19937 random(12);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    const Direction n = probe_axis({0.29 * unit(random), 0.29 * unit(random)});
    const double size = std::exp(5 * unit(random));
    const SurfacePose pose{{0.06 + 0.03 * unit(random), 0.06 + 0.03 * unit(random)},
                           0.004 * unit(random),
                           {n.u * size, n.v * size, n.up * size}};
    const auto joints = joints_on(g, pose);
    REQUIRE(joints);
    const auto back = surface_pose(g, *joints);
    REQUIRE(back);
    REQUIRE(std::abs(back->contact_m.x_m - pose.contact_m.x_m) < 1e-12);
    REQUIRE(std::abs(back->contact_m.y_m - pose.contact_m.y_m) < 1e-12);
    REQUIRE(std::abs(back->clearance_m - pose.clearance_m) < 1e-12);
    REQUIRE(norm(minus(back->normal, n)) < 1e-12);
  }
}

TEST_CASE("Each rotation alone leans the axis in its own plane") {
  for (const double angle : {-0.3, -1e-9, 0.0, 1e-9, 0.02, 0.3}) {
    const Direction about_x = probe_axis({angle, 0});
    CHECK(norm(minus(about_x, {0, std::sin(angle), std::cos(angle)})) < 1e-15);
    const Direction about_y = probe_axis({0, angle});
    CHECK(norm(minus(about_y, {-std::sin(angle), 0, std::cos(angle)})) < 1e-15);
    for (const Direction& axis : {about_x, about_y})
      CHECK(std::abs(angle_between(axis, {0, 0, 1}) - std::abs(angle)) < 1e-15);
  }
}

TEST_CASE("A plate that rises by b along y is levelled by rx = -atan b, along x by ry = atan a") {
  const double a = 0.03, b = -0.05;
  const auto only_y = tilts_along({0, -b, 1});
  const auto only_x = tilts_along({-a, 0, 1});
  REQUIRE(only_y);
  REQUIRE(only_x);
  CHECK(std::abs(only_y->rx_rad + std::atan(b)) < 1e-15);
  CHECK(only_y->ry_rad == 0);
  CHECK(only_x->rx_rad == 0);
  CHECK(std::abs(only_x->ry_rad - std::atan(a)) < 1e-15);
  const auto both = tilts_along({-a, -b, 1});
  REQUIRE(both);
  CHECK(angle_between(probe_axis(*both), {-a, -b, 1}) < 1e-15);
}

TEST_CASE("A normal along the warp is refused as the singularity it is") {
  for (const double u : {1.0, -1.0}) {
    const auto tilts = tilts_along({u, 0, 1e-12});
    REQUIRE_FALSE(tilts);
    CHECK(tilts.error().code == weft::Errc::invalid_argument);
    CHECK_THAT(tilts.error().what, Catch::Contains("warp"));
  }
  CHECK(tilts_along({1, 0, 1e-6}));  // very near to it there is an answer
}

TEST_CASE("Normals that point into the plate, are zero or are not numbers are refused") {
  for (const Direction& n : {Direction{0, 0, -1},
                             {0, 1, 0},
                             {0, 1, -0.1},
                             {0, 0, 0},
                             {nan_value, 0, 1},
                             {0, nan_value, 1},
                             {0, 0, INFINITY}}) {
    const auto tilts = tilts_along(n);
    REQUIRE_FALSE(tilts);
    CHECK(tilts.error().code == Errc::invalid_argument);
  }
}

TEST_CASE("Joints that are not numbers or lean a quarter turn have no surface pose") {
  for (const Axis axis : all_axes) {
    Joints joints;
    joints.value = {0.05, 0.05, 0.09, 0, 0};
    joints[axis] = nan_value;
    CHECK_FALSE(surface_pose(bench_geometry(), joints));
  }
  Joints turned;
  turned.value = {0.05, 0.05, 0.09, std::numbers::pi / 2, 0};
  const auto pose = surface_pose(bench_geometry(), turned);
  REQUIRE_FALSE(pose);
  CHECK_THAT(to_string(pose.error()), Catch::Contains("quarter turn"));
}

TEST_CASE("A pose beyond the travel is refused with the stage that cannot go there") {
  const auto joints = joints_on(bench_geometry(), {{0.05, 0.05}, 0, {0, 1, 1}});
  REQUIRE_FALSE(joints);
  CHECK(joints.error().code == Errc::range);
  CHECK_THAT(to_string(joints.error()), Catch::Contains("rx = 0.78"));
}

}  // namespace surface_pose_test
