#include "sim/plant/contact.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "sim/plant/plant.hpp"
#include "tests/unit/plant/support.hpp"

namespace contact_test {

using namespace weft;
using namespace weft::sim;
using test::level_plate;
using test::plain;
using test::plate_z;

namespace {

/// Lowered to `z_m` from far above, at rest there.
ContactState lowered(const ContactModel& model, double z_m, double dt_s = 0.003) {
  ContactState state = model.step({}, {.z_m = 0}, 0);
  for (int i = 1; i <= 200; ++i) state = model.step(state, {.z_m = z_m * i / 200}, dt_s);
  return state;
}

double shape(double x) {
  return std::sinh(x) / x;
}

}  // namespace

TEST_CASE("inside the slack the cloth carries the probe's weight whatever the stage does") {
  const Mount mount;
  const ContactModel model(level_plate(), mount, plain("cotton"));
  const ContactState touch = lowered(model, plate_z - 0.45e-3 - mount.slack_m / 2);
  for (const double lower : {0.0, 0.05e-3, 0.15e-3}) {
    const ContactState state = model.step(touch, {.z_m = touch.pose.z_m + lower}, 0.01);
    CHECK(state.normal_n == Approx(1.96133).epsilon(1e-6));
    CHECK(state.extension_m < 0);
    CHECK(state.extension_m > -mount.slack_m);
  }
}

TEST_CASE("a static press has the closed form's indentation") {
  const ContactMaterial material = plain("denim");
  const ContactModel model(level_plate(), {}, material);
  const double area = level_plate().face_area_m2();
  for (const double z : {plate_z - 0.3e-3, plate_z - 0.25e-3}) {
    const ContactState state = lowered(model, z);
    const double f = state.normal_n;
    REQUIRE(f > 2);
    CHECK(state.indentation_m ==
          Approx(material.law.lambda_m * std::log1p(f / (area * material.law.pressure_pa)))
              .epsilon(1e-9));
    CHECK(f ==
          Approx(Mount{}.weight_n() + Mount{}.stiffness_n_m * state.extension_m).epsilon(1e-9));
    CHECK(model.pressure_pa(state, 0, 0, 1) == Approx(f / area).epsilon(1e-9));
  }
}

TEST_CASE("above the cloth nothing is felt") {
  const ContactModel model(level_plate(), {}, plain("pile"));
  const ContactState state = lowered(model, 0.04);
  CHECK(state.normal_n == 0);
  CHECK(state.friction_n[1] == 0);
  CHECK(model.pressure_pa(state, 1e-3, 1e-3, 5) == 0);
  CHECK(state.extension_m == Approx(Mount{}.hanging_extension_m()));
}

TEST_CASE("a tilted face averages the law over its width") {
  ContactGeometry geometry = level_plate();
  geometry.tilt_x = 2e-3;
  const ContactMaterial material = plain("silk");
  const ContactModel model(geometry, {}, material);
  const ContactState state = lowered(model, plate_z - 0.05e-3);
  const double x = geometry.tilt_x * geometry.face_half_width_m / material.law.lambda_m;
  const double centre = std::exp(state.indentation_m / material.law.lambda_m);
  const double force = geometry.face_area_m2() * material.law.pressure_pa * (centre * shape(x) - 1);
  CHECK(state.normal_n == Approx(force).epsilon(1e-9));
  CHECK(model.pressure_pa(state, 6e-3, 0, 1) > model.pressure_pa(state, -6e-3, 0, 1));
  CHECK(log_sinhc(1e-4) == Approx(std::log(shape(1e-4))).margin(1e-13));
  CHECK(log_sinhc(-3) == Approx(std::log(shape(3))).epsilon(1e-12));
}

TEST_CASE("the force relaxes under a held stage and comes back on the same cloth") {
  MaterialSwitches only_relaxation = test::plain_cloth;
  only_relaxation.relaxation = true;
  const Patch patch = test::patch_of(test::library(), "felt", 1, only_relaxation);
  const ContactModel model(level_plate(), {}, patch.material);
  ContactState state = lowered(model, plate_z - 1.0e-3, 1e-5);
  const double at_once = state.normal_n;
  for (int i = 0; i < 3000; ++i) state = model.step(state, state.pose, 0.01);
  CHECK(at_once > 2.2);
  CHECK(state.normal_n < 0.98 * at_once);  // the mount is soft: most of the load remains
  CHECK(state.normal_n > Mount{}.weight_n());
}

TEST_CASE("loading is above unloading at the same indentation") {
  MaterialSwitches only_hysteresis = test::plain_cloth;
  only_hysteresis.hysteresis = true;
  const Patch patch = test::patch_of(test::library(), "denim", 1, only_hysteresis);
  const ContactModel model(level_plate(), {}, patch.material);
  const ContactState down = lowered(model, plate_z - 0.2e-3);
  ContactState state = model.step(down, {.z_m = plate_z + 0.2e-3}, 0.01);
  while (state.indentation_m > down.indentation_m)
    state = model.step(state, {.z_m = state.pose.z_m - 1e-6}, 0.01);
  CHECK(state.normal_n < 0.6 * down.normal_n);
}

TEST_CASE("no stiffness and no pose makes a NaN") {
  for (const double stiffness : {1e1, 1e3, 1e5, 1e8})
    for (const double lambda : {1e-6, 1e-4, 5e-3})
      for (const double step_m : {1e-7, 1e-4, 0.1}) {
        Mount mount;
        mount.stiffness_n_m = stiffness;
        ContactMaterial material = plain("wool");
        material.law.lambda_m = lambda;
        material.hysteresis.eta = 0.3;
        material.relaxation = {{0.2, 0.2}, {0.3, 5}};
        const ContactModel model(level_plate(), mount, material);
        ContactState state = model.step({}, {.z_m = plate_z - 2e-3}, 0);
        for (int i = 0; i < 60; ++i) {
          const double z = state.pose.z_m + (i < 30 ? step_m : -step_m);
          state = model.step(state, {.y_m = 1e-4 * i, .z_m = z, .rx_rad = 0.08, .ry_rad = -0.08},
                             i % 3 == 0 ? 0 : 0.05);
          REQUIRE(std::isfinite(state.normal_n));
          REQUIRE(std::isfinite(state.indentation_m));
          REQUIRE(std::isfinite(model.pressure_pa(state, 6e-3, 6e-3, 100)));
          REQUIRE(state.normal_n >= 0);
        }
      }
}

TEST_CASE("the balance holds to rounding on every fabric, pressed to 10 N and released") {
  const FabricLibrary table = test::library();
  for (const Fabric& fabric : table.fabrics) {
    CAPTURE(fabric.name);
    const Patch patch = test::patch_of(table, fabric.name, 3);
    const ContactModel model(level_plate(), {}, patch.material);
    ContactState state = model.step({}, {.z_m = 0.05}, 0);
    double highest = 0;
    for (int i = 0; i < 6000; ++i) {
      const double z = 0.05 + 0.0105 * (i < 3000 ? i : 6000 - i) / 3000;
      state = model.step(state, {.x_m = 1e-6 * i, .z_m = z}, 0.003);
      const double balance = Mount{}.weight_n() + Mount{}.force_n(state.extension_m);
      REQUIRE(state.normal_n == Approx(balance).margin(2e-6));
      highest = std::max(highest, state.normal_n);
    }
    CHECK(highest > 10);
    CHECK(state.normal_n == 0);
  }
}

TEST_CASE("the bare plate is stiff and gives the probe's weight") {
  PlantParams params;
  params.geometry = level_plate();
  Plant plant(params, 1);
  plant.mount(bare_plate(), {.z_m = 0.05});
  for (int i = 0; i < 100; ++i) plant.advance({.z_m = 0.05 + 1e-4 * i}, 0.01);
  CHECK(plant.contact().normal_n == Approx(Mount{}.weight_n()).epsilon(1e-6));
  CHECK(std::abs(plant.contact().indentation_m) < 20e-6);
}

TEST_CASE("a rising stage load is loading at any step, through the corner of the mount too") {
  // The mount's stiffness changes where it begins to carry load. There a Newton step from the other
  // side is not a good initial value, and a false reversal would turn the hysteresis.
  MaterialSwitches switches = test::plain_cloth;
  switches.hysteresis = true;
  const ContactMaterial pile = test::patch_of(test::library(), "pile", 1, switches).material;
  const ContactModel model(level_plate(), {.slack_m = 0}, pile);
  const double touch_m = plate_z - pile.thickness_m;
  const auto pressed = [&](double dt_s) {
    ContactState state = model.step({}, {.z_m = touch_m - 0.1e-3}, dt_s);
    const auto steps = std::lround(3.3 / dt_s);
    for (long i = 1; i <= steps; ++i) {
      const double t_s = 3.3 * static_cast<double>(i) / static_cast<double>(steps);
      state = model.step(state, {.z_m = touch_m - 0.1e-3 + 1e-3 * t_s}, dt_s);
    }
    return state;
  };
  const ContactState coarse = pressed(3e-3);
  REQUIRE(coarse.normal_n > Mount{}.weight_n());
  CHECK(coarse.branch == Approx(1).epsilon(1e-3));
  for (const double dt_s : {96e-6, 24e-6, 12e-6, 6e-6}) {
    INFO("step " << dt_s << " s");
    const ContactState fine = pressed(dt_s);
    CHECK(fine.branch == Approx(1).epsilon(1e-3));
    CHECK(fine.normal_n == Approx(coarse.normal_n).epsilon(1e-3));
  }
}

}  // namespace contact_test
