// A plate tilted on its platform: heights and slopes against rotations in three dimensions, and the
// effect on the probe.

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "sim/plant/plant.hpp"

namespace tilted_plate_test {

using namespace weft;
using namespace weft::sim;

namespace {

constexpr double deg = std::numbers::pi / 180;
constexpr double surface_z = 0.06;
constexpr double settling_s = 0.05;  ///< a probe with inertia follows its stage

ContactGeometry askew(double tilt_x_rad, double tilt_y_rad) {
  ContactGeometry geometry;
  geometry.plate_z_m = surface_z;
  geometry.tilt_axis_y_m = 0.075;
  geometry.tilt_axis_depth_m = 0.012;
  geometry.plate_centre_x_m = 0.075;
  geometry.plate_tilt_x_rad = tilt_x_rad;
  geometry.plate_tilt_y_rad = tilt_y_rad;
  return geometry;
}

/// Height over plate_z_m of the plate under (x, y), by rotation of its normal and its middle about
/// the axis of rx.
double rise_by_rotation(const ContactGeometry& g, const Pose& pose) {
  const double c = std::cos(pose.rx_rad), s = std::sin(pose.rx_rad);
  // Normal of a level plate after rotation about y by ty and then about x by tx.
  const double n[3] = {-std::sin(g.plate_tilt_y_rad),
                       -std::cos(g.plate_tilt_y_rad) * std::sin(g.plate_tilt_x_rad),
                       std::cos(g.plate_tilt_y_rad) * std::cos(g.plate_tilt_x_rad)};
  const double turned[3] = {n[0], c * n[1] - s * n[2], s * n[1] + c * n[2]};
  // The middle is tilt_axis_depth_m above the axis; world: y from the axis, up from plate_z_m.
  const double middle_y = -s * g.tilt_axis_depth_m;
  const double middle_up = c * g.tilt_axis_depth_m - g.tilt_axis_depth_m;
  const double dx = pose.x_m - g.plate_centre_x_m;
  const double dy = pose.y_m - g.tilt_axis_y_m - middle_y;
  return middle_up - (turned[0] * dx + turned[1] * dy) / turned[2];
}

/// z of the stage at the first contact of the probe, lowered in steps of 0.1 um.
double touch_z(Level level, const ContactGeometry& geometry, Pose pose) {
  PlantParams params;
  params.level = level;
  params.geometry = geometry;
  params.rig_tilt = 0;
  Plant plant(params, 1);
  pose.z_m = surface_z - 4e-3;
  plant.mount(bare_plate(), pose);
  double step_m = 1e-4;
  while (step_m > 5e-8) {
    Pose lower = pose;
    lower.z_m += step_m;
    if (plant.peek(lower, settling_s).normal_n > 0) {
      step_m /= 2;
      continue;
    }
    plant.advance(lower, settling_s);
    pose = lower;
    REQUIRE(pose.z_m < surface_z + 8e-3);
  }
  return pose.z_m;
}

}  // namespace

TEST_CASE("the plate's height under the probe is that of a plane turned in three dimensions") {
  for (const double tilt_x : {0.0, 2 * deg, -1.1 * deg})
    for (const double tilt_y : {0.0, -2 * deg, 0.7 * deg})
      for (const double rx : {0.0, -2 * deg, 4 * deg}) {
        const ContactGeometry g = askew(tilt_x, tilt_y);
        for (const double x : {0.01, 0.075, 0.14})
          for (const double y : {0.02, 0.075, 0.13}) {
            const Pose pose{.x_m = x, .y_m = y, .rx_rad = rx};
            REQUIRE(std::abs(g.plate_rise_m(pose) - rise_by_rotation(g, pose)) < 1e-15);
          }
      }
}

TEST_CASE("rx = -x and ry = y make plate and face parallel") {
  const ContactGeometry g = askew(1.7 * deg, -0.9 * deg);
  const Pose level{.x_m = 0.05, .y_m = 0.05, .rx_rad = -1.7 * deg, .ry_rad = -0.9 * deg};
  CHECK(std::abs(g.face_slope(level)[0]) < 1e-15);
  CHECK(std::abs(g.face_slope(level)[1]) < 1e-15);
  CHECK(g.face_slope({})[0] == Approx(-std::tan(0.9 * deg) / std::cos(1.7 * deg)));
  CHECK(g.face_slope({})[1] == Approx(std::tan(1.7 * deg)));
}

TEST_CASE("the probe meets a tilted plate where the plate is, at levels L0 to L2") {
  const ContactGeometry g = askew(1.5 * deg, -1 * deg);
  const Pose middle{.x_m = 0.075, .y_m = 0.075};
  for (const Level level : {Level::algebraic, Level::quasistatic, Level::dynamic}) {
    const double here = touch_z(level, g, middle);
    const Pose corner{.x_m = 0.025, .y_m = 0.115};
    const double there = touch_z(level, g, corner);
    const double rise = rise_by_rotation(g, corner) - rise_by_rotation(g, middle);
    CHECK(std::abs(here - there - rise) < 0.5e-6);
  }
}

TEST_CASE("a tilted face meets the plate with its edge: half a face's width times the slope") {
  const double slope = std::tan(1 * deg);
  const double flat = touch_z(Level::quasistatic, askew(0, 0), {.x_m = 0.075, .y_m = 0.075});
  const double edge = touch_z(Level::quasistatic, askew(1 * deg, 0), {.x_m = 0.075, .y_m = 0.075});
  const double half_m = ContactGeometry{}.face_half_width_m;
  CHECK(flat - edge == Approx(half_m * slope).epsilon(0.05));  // compliance of the edge
}

TEST_CASE("a tilted plate loads the pads on its high side, and levelling evens them") {
  PlantParams params;
  params.geometry = askew(0, 0.02 * deg);
  params.rig_tilt = 0;
  params.pads.gain_spread = params.pads.gap_spread = 0;
  const auto share_of_high_side = [&](double ry_rad) {
    Plant plant(params, 1);
    const Pose pose{.x_m = 0.075, .y_m = 0.075, .z_m = surface_z + 0.2e-3, .ry_rad = ry_rad};
    plant.mount(bare_plate(), pose);
    plant.advance(pose, 0.01);
    for (int stage = 0; stage < 8; ++stage) plant.convert(stage, 0);
    double high = 0, all = 0;
    for (std::size_t i = 0; i < pad_count; ++i) {
      all += plant.pad_pressures_pa()[i];
      if (pad_dx_m(i) > 0) high += plant.pad_pressures_pa()[i];
    }
    return high / all;
  };
  CHECK(share_of_high_side(0) > 0.6);
  CHECK(share_of_high_side(0.02 * deg) == Approx(0.5).margin(1e-9));
}

}  // namespace tilted_plate_test
