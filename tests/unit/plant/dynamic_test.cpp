#include "sim/plant/dynamic/dynamic_contact.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "protocols/base/time.hpp"
#include "tests/unit/plant/dynamic_support.hpp"

namespace dynamic_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::sim::test;

namespace {

ContactGeometry far_plate() {
  ContactGeometry geometry;
  geometry.plate_z_m = 9;
  return geometry;
}

/// A spring that pulls and pushes: the mount without slack, far above any fabric.
struct Swing {
  Mount mount;
  double rest_m;  ///< of the extension

  Swing(double stiffness_n_m, double mass_kg) {
    mount = {mass_kg, stiffness_n_m, 0, stiffness_n_m};
    rest_m = -mount.weight_n() / stiffness_n_m;
  }
  [[nodiscard]] ContactState pulled(double from_rest_m) const {
    ContactState state;
    state.extension_m = rest_m - from_rest_m;  // z = stage - extension
    return state;
  }
  [[nodiscard]] double swing_m(const ContactState& state) const {
    return rest_m - state.extension_m;
  }
  [[nodiscard]] double energy_j(const ContactState& state) const {
    const double x = swing_m(state), v = state.velocity_mps[2];
    return 0.5 * mount.stiffness_n_m * x * x + 0.5 * mount.mass_kg * v * v;
  }
};

}  // namespace

TEST_CASE("a press to 5 N comes to rest at the closed form's indentation") {
  const ContactMaterial material = plain("denim");
  const Mount mount;
  const double top_n = level_plate().face_area_m2() * material.law.pressure_pa;
  const double delta_m = material.law.lambda_m * std::log1p(5 / top_n);
  const double stage_z =
      plate_z - material.thickness_m + delta_m + (5 - mount.weight_n()) / mount.stiffness_n_m;
  for (const Integrator integrator : every)
    for (const double step_s : {2e-4, 3e-3}) {
      const DynamicContact contact(level_plate(), mount, material, with_step(step_s, integrator));
      ContactState state = hanging(material, stage_z - 1.5e-3);
      for (int i = 1; i <= 1000; ++i)
        state = contact.step(state, {.z_m = stage_z - 1.5e-3 * (1 - i / 1000.0)}, 3e-3);
      state = contact.step(state, state.pose, 5);
      CHECK(state.normal_n == Approx(5).epsilon(1e-9));
      CHECK(state.indentation_m == Approx(delta_m).epsilon(1e-9));
      CHECK(state.load_ratio == Approx(1).epsilon(1e-9));
      CHECK(std::abs(state.velocity_mps[2]) < 1e-9);
    }
}

TEST_CASE("an undamped mass on a spring keeps amplitude and energy at every step") {
  for (const double stiffness : {1e1, 1e4, 1e8})
    for (const double h_omega : {1e-2, 0.2, 2.0}) {
      const Swing swing(stiffness, 0.2);
      const double step_s = h_omega * std::sqrt(0.2 / stiffness);
      const DynamicContact contact(far_plate(), swing.mount, plain("felt"), undamped(step_s));
      ContactState state = swing.pulled(1e-5);
      const double before = swing.energy_j(state);
      double highest = 0;
      for (int i = 0; i < 2000; ++i) {
        state = contact.step(state, state.pose, 10 * step_s);
        if (i > 1000) highest = std::max(highest, std::abs(swing.swing_m(state)));
      }
      CAPTURE(stiffness, h_omega);
      CHECK(swing.energy_j(state) == Approx(before).epsilon(1e-6));
      CHECK(highest == Approx(1e-5).epsilon(h_omega < 0.1 ? 0.01 : 0.02));
    }
}

TEST_CASE("a damped swing follows its closed form to second order") {
  const double k = 1e4, m = 0.2, zeta = 0.1;
  const Swing swing(k, m);
  const double omega = std::sqrt(k / m), damped = omega * std::sqrt(1 - zeta * zeta), t_s = 0.08;
  const double exact_m = 1e-4 * std::exp(-zeta * omega * t_s) *
                         (std::cos(damped * t_s) + zeta * omega / damped * std::sin(damped * t_s));
  for (const Integrator integrator : every) {
    double last = 0;
    for (const double step_s : {4e-4, 2e-4, 1e-4}) {
      DynamicsParams params = with_step(step_s, integrator);
      params.normal_damping = zeta;
      const DynamicContact contact(far_plate(), swing.mount, plain("felt"), params);
      const ContactState state = contact.step(swing.pulled(1e-4), {}, t_s);
      const double error = std::abs(swing.swing_m(state) - exact_m);
      if (last > 0) CHECK(std::log2(last / error) == Approx(2).margin(0.1));
      last = error;
    }
    CHECK(last < 1e-4 * 2e-3);
  }
}

TEST_CASE("a half swing returns the velocity by e^{-pi zeta/sqrt(1 - zeta^2)}") {
  for (const double zeta : {0.0, 0.05, 0.3}) {
    const Swing swing(1e4, 0.2);
    DynamicsParams params = undamped(1e-6);
    params.normal_damping = zeta;
    const DynamicContact contact(far_plate(), swing.mount, plain("felt"), params);
    ContactState state = swing.pulled(0);
    state.velocity_mps[2] = 0.01;
    const double root = std::sqrt(1 - zeta * zeta);
    state = contact.step(state, {}, std::numbers::pi / (std::sqrt(1e4 / 0.2) * root));
    CHECK(-state.velocity_mps[2] ==
          Approx(0.01 * std::exp(-std::numbers::pi * zeta / root)).epsilon(1e-6));
  }
}

TEST_CASE("a probe dropped on a cloth without losses bounces back to where it fell from") {
  const ContactMaterial material = plain("felt");
  Mount mount;
  mount.slack_m = 20e-3;  // free to fall and to rise
  const double surface = plate_z - material.thickness_m;
  for (const double step_s : {1e-5, 2e-4}) {
    const DynamicContact contact(level_plate(), mount, material, undamped(step_s));
    ContactState state;
    state.pose.z_m = surface - 1e-3 - 5e-3;  // 5 mm into the slack, 1 mm above the fabric
    state.extension_m = -5e-3;
    double highest = 1, hardest = 0;
    int bounces = 0;
    double last = 0;
    for (int i = 0; i < 2000; ++i) {
      state = contact.step(state, state.pose, 2e-4);
      hardest = std::max(hardest, state.normal_n);
      if (last < 0 && state.velocity_mps[2] >= 0) {  // top of a flight
        ++bounces;
        highest = surface - state.probe_z_m();
        CHECK(highest == Approx(1e-3).epsilon(step_s < 1e-4 ? 2e-3 : 0.03));
      }
      last = state.velocity_mps[2];
    }
    CHECK(bounces >= 5);
    CHECK(hardest > 2 * mount.weight_n());
  }
}

TEST_CASE("losses of the cloth make every bounce lower") {
  const ContactMaterial material = whole("felt");
  Mount mount;
  mount.slack_m = 20e-3;
  const DynamicContact contact(level_plate(), mount, material, undamped(5e-5));
  ContactState state;
  state.pose.z_m = plate_z - material.thickness_m - 6e-3;
  state.extension_m = -5e-3;
  double top = state.probe_z_m(), last = 0;
  int bounces = 0;
  for (int i = 0; i < 3000; ++i) {
    state = contact.step(state, state.pose, 1e-4);
    if (last < 0 && state.velocity_mps[2] >= 0) {
      ++bounces;
      CHECK(state.probe_z_m() > top);
      top = state.probe_z_m();
    }
    last = state.velocity_mps[2];
  }
  CHECK(bounces >= 2);
  state = contact.step(state, state.pose, 3);
  CHECK(state.normal_n == Approx(mount.weight_n()).epsilon(0.01));
}

TEST_CASE("touch-down is found inside a step: a fall of 1 mm within one substep of 20 ms") {
  const ContactMaterial material = plain("denim");
  Mount mount;
  mount.slack_m = 20e-3;
  const double exact_s = std::sqrt(2 * 1e-3 / standard_gravity_mps2);
  for (const Integrator integrator : every) {
    const DynamicContact contact(level_plate(), mount, material, undamped(0.02, integrator));
    ContactState state;
    state.pose.z_m = plate_z - material.thickness_m - 6e-3;
    state.extension_m = -5e-3;
    CHECK(contact.step(state, state.pose, exact_s - 1e-9).normal_n == 0);
    const ContactState after = contact.step(state, state.pose, exact_s + 1e-6);
    CHECK(after.normal_n > 0);
    CHECK(after.velocity_mps[2] == Approx(standard_gravity_mps2 * exact_s).epsilon(1e-4));
    CHECK(after.indentation_m == Approx(1e-6 * after.velocity_mps[2]).epsilon(0.01));
  }
}

TEST_CASE("both methods are of second order across touch-down, impact and lift-off") {
  const ContactMaterial material = plain("felt");
  Mount mount;
  mount.slack_m = 20e-3;
  ContactState start;
  start.pose.z_m = plate_z - material.thickness_m - 6e-3;
  start.extension_m = -5e-3;
  const auto landed = [&](double step_s, Integrator integrator, double t_s) {
    const DynamicContact contact(level_plate(), mount, material, with_step(step_s, integrator));
    return contact.step(start, start.pose, t_s).probe_z_m();
  };
  for (const double t_s : {0.02, 0.06}) {  // in contact; after several flights
    const double truth = landed(1e-6, Integrator::midpoint, t_s);
    for (const Integrator integrator : equal_substeps) {
      const double coarse = std::abs(landed(2e-4, integrator, t_s) - truth);
      const double fine = std::abs(landed(5e-5, integrator, t_s) - truth);
      CAPTURE(t_s, integrator == Integrator::midpoint, coarse, fine);
      CHECK(std::log2(coarse / fine) / 2 == Approx(2).margin(0.2));
    }
  }
}

TEST_CASE("a press on a cloth with memory converges with second order") {
  const ContactMaterial material = whole("wool");
  const auto moved = [&](ContactState state, int from, int to, double step_s,
                         Integrator integrator) {
    const DynamicContact contact(level_plate(), {}, material, with_step(step_s, integrator));
    for (int i = from + 1; i <= to; ++i) {
      const Pose pose{.y_m = 1e-5 * i, .z_m = plate_z - material.thickness_m + 1e-5 * i};
      state = contact.step(state, pose, 0.01);
    }
    return state;
  };
  // In contact from here on: the step in which the first contact falls does not affect the order.
  const ContactState touching = moved(hanging(material, plate_z - material.thickness_m - 0.1e-3), 0,
                                      30, 2e-6, Integrator::midpoint);
  REQUIRE(touching.normal_n > 0);
  const auto pressed = [&](double step_s, Integrator integrator) {
    return moved(touching, 30, 60, step_s, integrator);
  };
  const ContactState truth = pressed(2e-6, Integrator::midpoint);
  REQUIRE(truth.normal_n > 4);
  for (const Integrator integrator : every) {
    const ContactState coarse = pressed(5e-5, integrator), fine = pressed(1.25e-5, integrator);
    const double a = std::abs(coarse.normal_n - truth.normal_n);
    const double b = std::abs(fine.normal_n - truth.normal_n);
    CAPTURE(integrator == Integrator::midpoint, a, b);
    CHECK(std::abs(pressed(1e-3, integrator).normal_n - truth.normal_n) < 1e-3);
    CHECK(std::log2(a / b) / 2 > 1.8);
    CHECK(fine.friction_n[1] == Approx(truth.friction_n[1]).epsilon(1e-3));
  }
}

TEST_CASE("in slow motion level L2 goes over into level L1") {
  for (const char* name : {"denim", "silk", "jersey"}) {
    const ContactMaterial material = whole(name);
    const ContactModel statics(level_plate(), {}, material);
    double last_error = 0;
    for (const double speed : {1e-3, 1e-4}) {
      DynamicsParams params = with_step(speed > 5e-4 ? 2e-4 : 1e-3);
      params.static_ratio = 1;
      params.lateral_stiffness_n_m = 1e7;
      const DynamicContact contact(level_plate(), {}, material, params);
      ContactState dynamic = hanging(material, plate_z - material.thickness_m - 0.1e-3);
      ContactState quasistatic = dynamic;
      double error = 0;
      const double dt_s = 3e-6 / speed;
      for (int i = 0; i < 350; ++i) {
        const bool pressing = quasistatic.normal_n < 5;
        Pose pose = quasistatic.pose;
        (pressing ? pose.z_m : pose.y_m) += 3e-6;
        dynamic = contact.step(dynamic, pose, dt_s);
        quasistatic = statics.step(quasistatic, pose, dt_s);
        error = std::max(error, std::abs(dynamic.normal_n - quasistatic.normal_n));
      }
      CAPTURE(name, speed, error);
      REQUIRE(quasistatic.normal_n > 4.5);
      // The force of a mass that is stopped from that speed by a spring as stiff as the fabric at 5
      // N.
      const double bound = speed * std::sqrt(5 / material.law.lambda_m * Mount{}.mass_kg);
      CHECK(error < 2 * bound);
      CHECK(dynamic.friction_n[1] == Approx(quasistatic.friction_n[1]).margin(0.2 * bound));
      if (last_error > 0) CHECK(error < last_error);
      last_error = error;
    }
  }
}

TEST_CASE("a run that is stopped and taken up again has the same bits") {
  const ContactMaterial material = whole("terry");
  for (const Integrator integrator : every) {
    const DynamicContact contact(level_plate(), {}, material, with_step(2e-4, integrator));
    const auto path = [&](int i) { return down_and_up(material, i); };
    ContactState single = hanging(material, path(0).z_m), split = single;
    for (int i = 1; i <= 600; ++i) single = contact.step(single, path(i), 3.072e-3);
    for (int i = 1; i <= 600; ++i) {
      static_cast<void>(contact.step(split, path(i), 1.7e-3));  // an observer looks in between
      const DynamicContact again = contact;
      split = again.step(split, path(i), 3.072e-3);
    }
    CHECK(split.normal_n == single.normal_n);
    CHECK(split.extension_m == single.extension_m);
    CHECK(split.velocity_mps == single.velocity_mps);
    CHECK(split.bristle == single.bristle);
    CHECK(split.lag_m == single.lag_m);
    CHECK(split.relaxation.relaxed_n == single.relaxation.relaxed_n);
  }
}

TEST_CASE("a cloth without a coefficient of friction still has its viscous one: F = sigma2 v") {
  ContactMaterial material = plain("felt");
  REQUIRE(material.friction.coefficient == 0);
  for (const Integrator integrator : every) {
    DynamicsParams params = with_step(2e-4, integrator);
    params.viscous_n_s_m = 40;
    params.lateral_stiffness_n_m = 1e4;
    const DynamicContact contact(level_plate(), {}, material, params);
    const double z_m = plate_z - material.thickness_m + 1.2e-3, speed_mps = 3e-3;
    ContactState state = hanging(material, z_m);
    for (int i = 1; i <= 1000; ++i)
      state = contact.step(state, {.y_m = speed_mps * 1e-3 * i, .z_m = z_m}, 1e-3);
    REQUIRE(state.normal_n > 0);
    CHECK(state.friction_n[1] == Approx(40 * speed_mps).epsilon(1e-6));
    CHECK(state.lag_m[1] * 1e4 == Approx(40 * speed_mps).epsilon(1e-6));
    CHECK(state.friction_n[0] == 0);
  }
}

TEST_CASE("contact is lost and found again without a trace of the first") {
  const ContactMaterial material = whole("cotton");
  const double touch = plate_z - material.thickness_m;
  for (const Integrator integrator : every) {
    const DynamicContact contact(level_plate(), {}, material, with_step(2e-4, integrator));
    ContactState state = hanging(material, touch - 0.8e-3);
    double peaks[2] = {};
    for (double& peak : peaks) {
      for (int i = 1; i <= 400; ++i) {
        state = contact.step(state, {.y_m = 0, .z_m = touch - 0.8e-3 + 3.5e-6 * i}, 3e-3);
        peak = std::max(peak, state.normal_n);
      }
      for (int i = 1; i <= 400; ++i)
        state = contact.step(state, {.y_m = 0, .z_m = touch + 0.6e-3 - 3.5e-6 * i}, 3e-3);
      state = contact.step(state, {.z_m = touch - 0.8e-3}, 3e-3);
      CHECK(state.normal_n == 0);
      CHECK(state.branch == -1);
      CHECK(state.bristle == Vector2{});
      state = contact.step(state, state.pose, 60);  // fabric and probe come to rest
    }
    CHECK(peaks[0] > 4);
    CHECK(peaks[1] == Approx(peaks[0]).epsilon(1e-3));
  }
}

}  // namespace dynamic_test
