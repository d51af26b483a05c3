// Level L2 in difficult cases: stiff, coarse, fast, absurd.

#include "sim/plant/dynamic/dynamic_contact.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/unit/plant/dynamic_support.hpp"

namespace dynamic_extremes_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::sim::test;

TEST_CASE("no stiffness, step, load or speed makes level L2 leave the numbers") {
  for (const Integrator integrator : every)
    for (const double stiffness : {1e1, 1e4, 1e8})
      for (const double step_s : {1e-6, 2e-4, 0.05})
        for (const double lambda : {1e-9, 1e-6, 5e-3})
          for (const double speed : {0.0, 4e-3, 4.0001e-3, 3.0}) {
            Mount mount;
            mount.stiffness_n_m = stiffness;
            ContactMaterial material = whole("wool");
            material.law.lambda_m = lambda;
            DynamicsParams params = undamped(step_s, integrator);
            params.lateral_stiffness_n_m = stiffness;
            REQUIRE(check(level_plate(), mount, material, params));
            const DynamicContact contact(level_plate(), mount, material, params);
            ContactState state = hanging(material, plate_z - 2e-3, mount);
            const double dt_s = std::min(20 * step_s, 0.05);
            for (int i = 0; i < 40; ++i) {
              const double way = speed * dt_s * (i < 20 ? 1 : -1);
              state = contact.step(state,
                                   {.x_m = state.pose.x_m + way,
                                    .y_m = state.pose.y_m - way,
                                    .z_m = i == 5 ? plate_z : state.pose.z_m + way,
                                    .rx_rad = 0.05,
                                    .ry_rad = -0.05},
                                   i % 7 == 3 ? 0 : dt_s);
              CAPTURE(stiffness, step_s, lambda, speed, i);
              REQUIRE(std::isfinite(state.normal_n));
              REQUIRE(state.normal_n >= 0);
              REQUIRE(std::isfinite(state.indentation_m));
              REQUIRE(std::isfinite(state.velocity_mps[2]));
              REQUIRE(std::isfinite(state.velocity_mps[1]));
              REQUIRE(std::isfinite(state.friction_n[0]));
              REQUIRE(std::isfinite(state.lag_m[0]));
              REQUIRE(std::isfinite(state.load_ratio));
            }
          }
}

TEST_CASE("a pressed probe without damping neither gains energy nor loses its rest in 1e5 steps") {
  const ContactMaterial material = plain("nylon");
  for (const double step_s : {2e-4, 3e-3}) {
    const DynamicContact contact(level_plate(), {}, material, undamped(step_s));
    ContactState state = hanging(material, plate_z - material.thickness_m - 0.1e-3);
    for (int i = 1; i <= 200; ++i)
      state = contact.step(state, {.z_m = plate_z - material.thickness_m + 3e-6 * i}, 3e-3);
    double early = 0, late = 0;
    for (int i = 0; i < 1000; ++i) {
      state = contact.step(state, state.pose, 100 * step_s);
      double& swing = i < 200 ? early : late;
      swing = std::max(swing, std::abs(state.velocity_mps[2]));
    }
    CHECK(late < 1.1 * early);
    CHECK(late > 0.5 * early);
  }
}

TEST_CASE("poses and times that cannot be change nothing") {
  const ContactMaterial material = whole("velvet");
  const DynamicContact contact(level_plate(), {}, material, {});
  const ContactState state = hanging(material, plate_z);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, -inf, 1e308, -1e308})
    for (int axis = 0; axis < 5; ++axis) {
      Pose pose = state.pose;
      double* fields[] = {&pose.x_m, &pose.y_m, &pose.z_m, &pose.rx_rad, &pose.ry_rad};
      *fields[axis] = bad;
      const ContactState after = contact.step(state, pose, 0.01);
      CHECK(after.pose == state.pose);
      CHECK(after.normal_n == state.normal_n);
    }
  for (const double bad : {nan, inf, 1e308, -1.0})
    CHECK(contact.step(state, {}, bad).pose.z_m == state.pose.z_m);
  const ContactState denormal = contact.step(state, {.z_m = plate_z}, 5e-324);
  CHECK(std::isfinite(denormal.velocity_mps[2]));
  CHECK(std::isfinite(denormal.normal_n));
}

TEST_CASE("a jump of the stages along the cloth leaves the probe over the waves where it was") {
  ContactMaterial material = whole("velvet");
  material.waviness = Waviness({.rms_m = 50e-6}, 3);
  const DynamicContact contact(level_plate(), {}, material, {});
  ContactState state = hanging(material, plate_z);
  for (int i = 0; i < 100; ++i) state = contact.step(state, {.z_m = plate_z}, 0.01);
  REQUIRE(state.normal_n > 0);
  Pose away = state.pose;
  away.x_m += 10e-3;
  away.y_m -= 7e-3;
  const ContactState after = contact.step(state, away, 0);
  CHECK(after.face_x_m() == Approx(state.face_x_m()).margin(1e-15));
  CHECK(after.exponent == Approx(state.exponent).epsilon(1e-9));
  CHECK(after.normal_n == Approx(state.normal_n).epsilon(1e-9));
}

TEST_CASE("parameters that cannot be are refused with a sentence that names them") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  CHECK(check(level_plate(), {}, whole("silk"), {}));
  const auto fields = [](ContactGeometry& g, Mount& m, ContactMaterial& c, DynamicsParams& d) {
    return std::vector<double*>{&g.plate_z_m,
                                &g.face_half_width_m,
                                &g.tilt_axis_y_m,
                                &g.tilt_x,
                                &g.tilt_y,
                                &m.mass_kg,
                                &m.stiffness_n_m,
                                &m.slack_m,
                                &m.stop_stiffness_n_m,
                                &c.law.lambda_m,
                                &c.law.pressure_pa,
                                &c.thickness_m,
                                &c.hysteresis.eta,
                                &c.hysteresis.length,
                                &c.relaxation.share[0],
                                &c.relaxation.share[1],
                                &c.relaxation.time_s[0],
                                &c.relaxation.time_s[1],
                                &c.friction.coefficient,
                                &c.friction.reference_load_n,
                                &c.friction.exponent,
                                &c.friction.bristle_length_m,
                                &d.step_s,
                                &d.normal_damping,
                                &d.lateral_stiffness_n_m,
                                &d.lateral_damping,
                                &d.static_ratio,
                                &d.stribeck_speed_mps,
                                &d.friction_speed_mps,
                                &d.bristle_damping,
                                &d.viscous_n_s_m};
  };
  ContactGeometry geometry = level_plate();
  Mount mount;
  ContactMaterial material = whole("silk");
  DynamicsParams dynamics;
  const std::size_t count = fields(geometry, mount, material, dynamics).size();
  for (std::size_t i = 0; i < count; ++i)
    for (const double bad : {nan, inf, -inf, 1e308, -1e308}) {
      ContactGeometry g = geometry;
      Mount m = mount;
      ContactMaterial c = material;
      DynamicsParams d = dynamics;
      *fields(g, m, c, d)[i] = bad;
      const Status refused = check(g, m, c, d);
      CAPTURE(i, bad);
      REQUIRE_FALSE(refused);
      CHECK(refused.error().code == Errc::range);
      CHECK_FALSE(refused.error().what.empty());
      CHECK_FALSE(refused.error().where.empty());
      CHECK_FALSE(refused.error().got.empty());
    }
  dynamics.integrator = static_cast<Integrator>(9);
  CHECK_FALSE(check(geometry, mount, material, dynamics));
}

}  // namespace dynamic_extremes_test
