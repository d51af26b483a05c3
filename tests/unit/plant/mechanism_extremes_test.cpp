// Slack, tilt, cover, wear and trials of one mounting at the ends of their ranges, each against its
// closed form. Forces that a campaign holds: tests/unit/daemon/campaign/rest_test.cpp.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "sim/plant/plant.hpp"
#include "tests/unit/plant/dynamic_support.hpp"

namespace mechanism_extremes_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::sim::test;

namespace {

constexpr double settling_s = 2;
constexpr double forces_n[] = {0.1, 1, 1.9, 2, 5, 10};

PlantParams params_at(Level level) {
  PlantParams params;
  params.level = level;
  params.geometry = level_plate();
  params.rig_tilt = 0;
  params.mount.slack_m = 1e-3;
  // The probe comes to rest in settling_s in spite of any swing.
  params.dynamics.integrator = Integrator::tr_bdf2;
  return params;
}

Patch plain_patch(const std::string& fabric, FabricLibrary table = library()) {
  return patch_of(table, fabric, 1, plain_cloth);
}

double depth_m(const ContactMaterial& material, double force_n) {
  return material.law.lambda_m *
         std::log1p(force_n / (level_plate().face_area_m2() * material.law.pressure_pa));
}

/// z when the fabric carries `force_n`; `share` of the slack is used up under the weight.
double z_under_m(const ContactMaterial& material, const Mount& mount, double force_n,
                 double share = 0) {
  const double apart_n = force_n - mount.weight_n();
  const double spring_m = apart_n > 0   ? apart_n / mount.stiffness_n_m
                          : apart_n < 0 ? apart_n / mount.stop_stiffness_n_m - mount.slack_m
                                        : -share * mount.slack_m;
  return plate_z - material.thickness_m + depth_m(material, force_n) + spring_m;
}

ContactState at_rest(const PlantParams& params, const Patch& patch, double z_m) {
  Plant plant(params, 1);
  REQUIRE(check(params, patch.material));
  plant.mount(patch, {.z_m = plate_z - 20e-3});
  for (int i = 1; i <= 20; ++i)
    plant.advance({.z_m = plate_z - 20e-3 + i * (z_m - plate_z + 20e-3) / 20}, 0.1);
  plant.advance({.z_m = z_m}, settling_s);
  return plant.contact_now();
}

constexpr Level moving[] = {Level::quasistatic, Level::dynamic};

}  // namespace

TEST_CASE("slack of 0.1 to 5 mm: the weight within it, every other force outside, 0 above") {
  const Patch patch = plain_patch("felt");
  for (const Level level : moving)
    for (const double slack_m : {0.1e-3, 0.5e-3, 1e-3, 2e-3, 5e-3}) {
      PlantParams params = params_at(level);
      params.mount.slack_m = slack_m;
      const Mount& mount = params.mount;
      CAPTURE(level, slack_m);
      for (const double share : {0.01, 0.5, 0.99}) {
        const double z_m = z_under_m(patch.material, mount, mount.weight_n(), share);
        CHECK(at_rest(params, patch, z_m).normal_n == Approx(mount.weight_n()).epsilon(1e-4));
      }
      for (const double force_n : forces_n) {
        CAPTURE(force_n);
        const double z_m = z_under_m(patch.material, mount, force_n);
        CHECK(at_rest(params, patch, z_m).normal_n == Approx(force_n).epsilon(1e-3));
      }
      const double clear_m = plate_z - patch.material.thickness_m + mount.hanging_extension_m();
      CHECK(at_rest(params, patch, clear_m - 1e-6).normal_n == 0);
    }
}

TEST_CASE("a tilt of 30 mrad either way: the law's force, and pads apart by e^(tilt dx/lambda)") {
  constexpr double tilt = 30e-3;
  for (const Level level : moving)
    for (const double side : {1.0, -1.0}) {
      Patch patch = plain_patch("felt");
      patch.tilt_x = side * tilt;
      const FabricLaw& law = patch.material.law;
      const double reach = tilt * level_plate().face_half_width_m / law.lambda_m;
      const double raised_m = law.lambda_m * std::log(std::sinh(reach) / reach);
      const PlantParams params = params_at(level);
      const double z_m = z_under_m(patch.material, params.mount, 5) - raised_m;
      CAPTURE(level, side);
      CHECK(at_rest(params, patch, z_m).normal_n == Approx(5).epsilon(1e-3));
      Plant plant(params, 1);
      plant.mount(patch, {.z_m = z_m});
      plant.advance({.z_m = z_m}, settling_s);
      for (int stage = 0; stage < pad_timing::stages; ++stage) plant.convert(stage, 0);
      const auto& pressures_pa = plant.pad_pressures_pa();
      const std::size_t high = side > 0 ? 3 : 0, beside = side > 0 ? 2 : 1;
      REQUIRE(pressures_pa[beside] > 0);
      CHECK((pressures_pa[high] + law.pressure_pa) / (pressures_pa[beside] + law.pressure_pa) ==
            Approx(std::exp(tilt * pad_pitch_m / law.lambda_m)).epsilon(1e-6));
      CHECK(*std::min_element(pressures_pa.begin(), pressures_pa.end()) >= 0);
    }
}

TEST_CASE("a cover of 0 or 60 um: the depth under every force is that of the two in series") {
  for (const double cover_m : {0.0, 60e-6}) {
    FabricLibrary table = library();
    table.params.cover.lambda_m = cover_m;
    const Patch patch = plain_patch("denim", table);
    const FabricLaw cloth = *law_from_kes(table.find("denim")->kes);
    const FabricLaw both = compose(cloth, table.params.cover);
    CHECK(patch.material.law.lambda_m == both.lambda_m);
    CHECK((both.lambda_m > cloth.lambda_m) == (cover_m > 0));
    for (const Level level : moving)
      for (const double force_n : forces_n) {
        const PlantParams params = params_at(level);
        const double z_m = z_under_m(patch.material, params.mount, force_n);
        const ContactState state = at_rest(params, patch, z_m);
        CAPTURE(level, cover_m, force_n);
        CHECK(state.normal_n == Approx(force_n).epsilon(1e-3));
        CHECK(state.indentation_m == Approx(depth_m(patch.material, force_n)).epsilon(1e-3));
      }
  }
}

namespace {

constexpr double way_m = 1e-3;

struct Touch {
  double force_n;
  PlantMemory memory;  ///< state for the next trial
};

/// Down to `z_m`, `way_m` along y, with a scan, and up.
Touch touch(Plant& plant, const Patch& patch, double z_m, const PlantMemory* memory) {
  const double above_m = z_m - 3e-3;
  plant.mount(patch, {.z_m = above_m}, {}, memory);
  plant.advance({.z_m = z_m}, 0.003);
  plant.advance({.y_m = way_m, .z_m = z_m}, 0.003);
  for (int stage = 0; stage < pad_timing::stages; ++stage) plant.convert(stage, 0);
  const double force_n = plant.contact_now().normal_n;
  plant.advance({.y_m = way_m, .z_m = above_m}, 0.003);
  return {force_n, plant.memory()};
}

Patch mounted_patch(double wear_most) {
  FabricLibrary table = library();
  table.params.wear = {wear_most, 2e4};
  auto patch = cut_patch(*table.find("felt"), table.params, table.spread, plain_cloth,
                         PatchSeeds{.piece = 1, .mounting = 2, .touch = 3});
  WEFT_ASSERT(patch.has_value());
  return *patch;
}

}  // namespace

TEST_CASE("a hundred thousand touches of one mounting: the dose adds up, the cloth wears down") {
  const Patch patch = mounted_patch(0.05);
  const PlantParams params = params_at(Level::quasistatic);
  const double z_m = z_under_m(patch.material, params.mount, 5);
  const double area_m2 = level_plate().face_area_m2();
  Plant plant(params, 1);
  Touch last = touch(plant, patch, z_m, nullptr);
  const double first_n = last.force_n;
  double dose_pa_m = first_n / area_m2 * way_m;
  PlantMemory half = last.memory;
  constexpr int touches = 100'000;
  for (int i = 2; i <= touches; ++i) {
    const double before_n = last.force_n;
    last = touch(plant, patch, z_m, &last.memory);
    REQUIRE(last.force_n > 0);
    REQUIRE(last.force_n <= before_n);
    dose_pa_m += last.force_n / area_m2 * way_m;
    if (i == touches / 2) half = last.memory;
  }
  CHECK(last.memory.dose_pa_m == Approx(dose_pa_m).epsilon(1e-3));
  CHECK(last.force_n < 0.99 * first_n);
  Plant other(params, 1);  // continued by another plant
  for (int i = touches / 2 + 1; i <= touches; ++i) half = touch(other, patch, z_m, &half).memory;
  CHECK(half.dose_pa_m == last.memory.dose_pa_m);
  CHECK(half.pads.creep_pa == last.memory.pads.creep_pa);
  CHECK(other.pad_counts() == plant.pad_counts());
}

TEST_CASE("wear of 0 keeps a cloth's height, wear of 1 takes nine tenths of it at most") {
  for (const Level level : {Level::algebraic, Level::quasistatic, Level::dynamic})
    for (const double dose_pa_m : {0.0, 1e-9, 1e4, 1e15, 1e300}) {
      CAPTURE(level, dose_pa_m);
      for (const double most : {0.0, 1.0}) {
        const Patch patch = mounted_patch(most);
        Plant plant(params_at(level), 1);
        plant.mount(patch, {.z_m = plate_z - 20e-3});
        PlantMemory memory = plant.memory();
        memory.dose_pa_m = dose_pa_m;
        const ContactMaterial& cloth = patch.material;
        const double gone_m =
            std::min(most * cloth.law.lambda_m * std::log1p(dose_pa_m / patch.wear.scale_pa_m),
                     0.9 * cloth.thickness_m);
        const Mount mount = params_at(level).mount;
        const double surface_m = plate_z - cloth.thickness_m + gone_m;
        // Level L0 changes from the weight to its set point where the mount begins to push.
        const bool is_l0 = level == Level::algebraic;
        const double border_m =
            surface_m + (is_l0 ? depth_m(cloth, mount.weight_n()) : mount.hanging_extension_m());
        plant.mount(patch, {.z_m = border_m - 1e-3}, {}, &memory);
        const auto force_n = [&](double past_m) {
          return plant.peek({.z_m = border_m + past_m}, settling_s).normal_n;
        };
        CHECK(force_n(-2e-6) == Approx(is_l0 ? mount.weight_n() : 0));
        CHECK((is_l0 ? force_n(5e-6) == params_at(level).set_point_n : force_n(5e-6) > 0));
      }
    }
}

}  // namespace mechanism_extremes_test
