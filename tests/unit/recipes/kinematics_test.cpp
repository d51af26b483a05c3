#include "recipes/kinematics/kinematics.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "tests/unit/recipes/bench_geometry.hpp"

namespace kinematics_test {

using namespace weft;
using namespace weft::recipes;
using test::bench_geometry;
using test::joints_anywhere;

namespace {

using Vec3 = std::array<double, 3>;

Vec3 minus(const Vec3& a, const Vec3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
double dot(const Vec3& a, const Vec3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// World position (X, Y, up) of a fabric point, by rotation about the platform's axis: an
/// independent computation in 3-D, while kinematics.cpp works in planes.
Vec3 fabric_point_on_bench(const Geometry& g, const Joints& j, const Vec3& uvh) {
  const double c = std::cos(j[Axis::rx]);
  const double s = std::sin(j[Axis::rx]);
  const double a = uvh[1] - g.tilt_axis_y_m;
  const double b = uvh[2] + g.tilt_axis_depth_m;
  return {uvh[0] - (j[Axis::x] - g.origin_m.x_m),
          g.tilt_axis_y_m + c * a - s * b - (j[Axis::y] - g.origin_m.y_m),
          -g.surface_z_m - g.tilt_axis_depth_m + s * a + c * b};
}

/// World position of the face's centre.
Vec3 face_on_bench(const Geometry& g, const Joints& j) {
  return {g.probe_arm_m * std::sin(j[Axis::ry]), 0,
          -(j[Axis::z] - g.probe_arm_m) - g.probe_arm_m * std::cos(j[Axis::ry])};
}

}  // namespace

TEST_CASE("Without tilt the contact point is the stage position less the origin") {
  Joints joints;
  joints.value = {0.05, 0.07, 0.092, 0, 0};
  const ProbePose pose = forward(bench_geometry(), joints);
  CHECK(pose.contact_m.x_m == Approx(0.04));
  CHECK(pose.contact_m.y_m == Approx(0.05));
  CHECK(pose.clearance_m == Approx(0.008));
  CHECK(lean_rad(pose) == 0);
}

TEST_CASE("Forward and inverse undo each other over the whole range") {
  const Geometry g = bench_geometry();
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    const Joints joints = joints_anywhere(g, random);
    const Result<Joints> back = inverse(g, forward(g, joints));
    REQUIRE(back);
    for (const Axis axis : all_axes) REQUIRE(std::abs((*back)[axis] - joints[axis]) < 1e-14);
  }
}

TEST_CASE("The pose puts the face at the place that a three-dimensional rotation gives") {
  const Geometry g = bench_geometry();
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 500; ++i) {
    Joints j;
    j.value = {0.07 + 0.05 * unit(random), 0.07 + 0.05 * unit(random), 0.09 + 0.01 * unit(random),
               0.3 * unit(random), 0.3 * unit(random)};
    const ProbePose pose = forward(g, j);
    const Vec3 foot{pose.contact_m.x_m, pose.contact_m.y_m, pose.clearance_m};
    const Vec3 gap = minus(face_on_bench(g, j), fabric_point_on_bench(g, j, foot));
    REQUIRE(std::sqrt(dot(gap, gap)) < 1e-15 * 100);
  }
}

TEST_CASE("The lean is the angle between the probe's axis and the plate's normal") {
  const Geometry g = bench_geometry();
  for (const double rx : {0.0, 1e-9, 0.05, -0.2})
    for (const double ry : {0.0, 1e-9, -0.04, 0.25}) {
      Joints j;
      j.value = {0.07, 0.07, 0.09, rx, ry};
      const Vec3 normal =
          minus(fabric_point_on_bench(g, j, {0, 0, 1}), fabric_point_on_bench(g, j, {0, 0, 0}));
      const Vec3 tool{std::sin(ry), 0, -std::cos(ry)};
      const Vec3 cross{normal[1] * tool[2] - normal[2] * tool[1],
                       normal[2] * tool[0] - normal[0] * tool[2],
                       normal[0] * tool[1] - normal[1] * tool[0]};
      const double angle = std::atan2(std::sqrt(dot(cross, cross)), -dot(normal, tool));
      CHECK(std::abs(lean_rad(forward(g, j)) - angle) < 1e-15);
    }
}

TEST_CASE("Tilting the plate about its own surface line leaves the points of that line alone") {
  Geometry g = bench_geometry();
  g.tilt_axis_depth_m = 0;
  const ProbePose upright{{0.03, 0.06}, 0, 0, 0};
  const ProbePose tilted{{0.03, 0.06}, 0, 0.2, 0};
  const Result<Joints> a = inverse(g, upright);
  const Result<Joints> b = inverse(g, tilted);
  REQUIRE(a);
  REQUIRE(b);
  for (const Axis axis : {Axis::x, Axis::y, Axis::z})
    CHECK((*a)[axis] == Approx((*b)[axis]).margin(1e-15));
}

TEST_CASE("Poses out of reach are refused with every stage that cannot go there") {
  const Result<Joints> joints = inverse(bench_geometry(), {{0.2, 0.05}, 0.15, 0.4, 0});
  REQUIRE_FALSE(joints);
  CHECK(joints.error().code == Errc::range);
  CHECK_THAT(joints.error().got, Catch::Contains("x = 0.21"));
  CHECK_THAT(joints.error().got, Catch::Contains("rx = 0.4"));
  CHECK_THAT(joints.error().got, Catch::Contains("z = "));
}

TEST_CASE("Poses that are not numbers or lean a quarter turn are refused") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const ProbePose& pose : {ProbePose{{nan, 0}, 0, 0, 0},
                                {{0, nan}, 0, 0, 0},
                                {{0, 0}, INFINITY, 0, 0},
                                {{0, 0}, 0, std::numbers::pi / 2, 0},
                                {{0, 0}, 0, 0, -1.6}}) {
    const Result<Joints> joints = inverse(bench_geometry(), pose);
    REQUIRE_FALSE(joints);
    CHECK(joints.error().code == Errc::invalid_argument);
  }
}

}  // namespace kinematics_test
