// One plant at several levels: the computed parts, and the parts that no sensor needs.

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "sim/plant/plant.hpp"
#include "tests/unit/plant/support.hpp"

namespace plant_levels_test {

using namespace weft;
using namespace weft::sim;
using test::plate_z;

namespace {

constexpr double grid_s = 3.072e-3;

PlantParams params_at(Level level) {
  PlantParams params;
  params.level = level;
  params.geometry = test::level_plate();
  params.mount.slack_m = 1e-3;
  return params;
}

Plant on_jersey(const PlantParams& params) {
  Plant plant(params, 1);
  plant.mount(test::patch_of(test::library(), "jersey", 1), {.z_m = plate_z - 5e-3});
  return plant;
}

/// Down to 0.6 mm below the fabric's surface, beyond the slack, in 3 s; then 4 mm along y in 2 s.
/// Calls `inspect` after every scan.
template <class Inspect>
void follow(Plant& plant, Inspect inspect) {
  const double touch_m = plate_z - 0.85e-3;
  const int down = 1000, along = 650;
  for (int i = 1; i <= down + along; ++i) {
    const double z = touch_m - 2e-3 + 2.6e-3 * std::min(1.0, static_cast<double>(i) / down);
    const double y = 4e-3 * std::max(0.0, static_cast<double>(i - down) / along);
    plant.advance({.y_m = y, .z_m = z}, grid_s);
    if (i % 9 != 0) plant.convert(i % 9 - 1, static_cast<std::uint64_t>(i / 9));
    if (i % 9 == 8) inspect();
  }
}

void press_and_slide(Plant& plant) {
  follow(plant, [] {});
}

}  // namespace

TEST_CASE("at level L0 the cloth carries the weight within the slack and the set point beyond it") {
  PlantParams params = params_at(Level::algebraic);
  params.set_point_n = 3.5;
  Plant plant = on_jersey(params);
  const double cloth_m =
      plate_z - test::patch_of(test::library(), "jersey", 1).material.thickness_m;
  const auto force_at = [&](double above_cloth_m) {
    plant.advance({.z_m = cloth_m - above_cloth_m}, grid_s);
    return plant.contact().normal_n;
  };
  const double weight_n = params.mount.weight_n();
  CHECK(force_at(1.1e-3) == 0);  // a hanging probe is one slack below the stage
  CHECK(plant.contact().probe_z_m() == Approx(cloth_m - 0.1e-3));
  CHECK(force_at(0.9e-3) == weight_n);
  CHECK(force_at(0.1e-3) == weight_n);
  CHECK(force_at(-1e-3) == 3.5);
  // a pressed probe stays pressed until the stage is a quarter of the slack above the rest position
  const double rests_m = 50.9e-6 * std::log1p(weight_n / (2.56e-4 * 15));  // jersey
  CHECK(force_at(0.15e-3 - rests_m) == 3.5);
  CHECK(force_at(0.40e-3 - rests_m) == weight_n);
  CHECK(force_at(2e-3) == 0);
}

TEST_CASE("at level L0 pads carry the set point on the mean, and their texture is linear") {
  PlantParams params = params_at(Level::algebraic);
  Plant plant = on_jersey(params);
  press_and_slide(plant);
  double mean_pa = 0;
  for (const double p : plant.pad_pressures_pa()) mean_pa += p / pad_count;
  CHECK(mean_pa == Approx(params.set_point_n / 2.56e-4).epsilon(0.2));
  CHECK(plant.texture_tiles() > 0);
}

TEST_CASE("unread sensors are not computed") {
  for (const Level level : {Level::algebraic, Level::quasistatic, Level::dynamic}) {
    PlantParams params = params_at(level);
    Plant all = on_jersey(params);
    params.watched.pads = false;
    Plant without_pads = on_jersey(params);
    params.watched.contact = false;
    Plant stages_only = on_jersey(params);
    for (Plant* plant : {&all, &without_pads, &stages_only}) press_and_slide(*plant);
    CAPTURE(to_string(level));
    CHECK(all.texture_tiles() > 0);
    CHECK(without_pads.texture_tiles() == 0);
    CHECK(without_pads.pad_counts() == on_jersey(params).pad_counts());
    // the pads do not affect the force
    CHECK(without_pads.contact().normal_n == all.contact().normal_n);
    CHECK(without_pads.contact().friction_n == all.contact().friction_n);
    CHECK(stages_only.contact().normal_n == 0);
    CHECK(stages_only.contact().pose == all.contact().pose);
  }
}

TEST_CASE("level L1 with shorter steps goes to nearly the same place") {
  PlantParams params = params_at(Level::quasistatic);
  Plant whole = on_jersey(params);
  params.quasistatic_step_s = grid_s;
  Plant same = on_jersey(params);
  params.quasistatic_step_s = grid_s / 4;
  Plant quarter = on_jersey(params);
  for (Plant* plant : {&whole, &same, &quarter}) press_and_slide(*plant);
  CHECK(same.contact().normal_n == whole.contact().normal_n);
  CHECK(quarter.contact().normal_n != whole.contact().normal_n);
  CHECK(quarter.contact().normal_n == Approx(whole.contact().normal_n).epsilon(1e-3));
}

TEST_CASE("level L1 balanced once or three times per scan keeps force and pads") {
  PlantParams params = params_at(Level::quasistatic);
  Plant each = on_jersey(params);
  params.quasistatic_step_s = GENERATE(27.027027e-3, 9.216e-3);
  Plant seldom = on_jersey(params);
  std::vector<std::array<std::uint16_t, pad_count>> counts, rough_counts;
  follow(each, [&] { counts.push_back(each.pad_counts()); });
  follow(seldom, [&] { rough_counts.push_back(seldom.pad_counts()); });
  CHECK(seldom.contact_now().pose == each.contact().pose);
  CHECK(seldom.contact_now().normal_n == Approx(each.contact().normal_n).epsilon(1e-3));
  REQUIRE(counts.size() == rough_counts.size());
  double squares = 0, worst = 0, moved = 0;
  for (std::size_t scan = 0; scan < counts.size(); ++scan)
    for (std::size_t pad = 0; pad < pad_count; ++pad) {
      const double error = 1.0 * counts[scan][pad] - rough_counts[scan][pad];
      squares += error * error / static_cast<double>(counts.size() * pad_count);
      worst = std::max(worst, std::abs(error));
      moved = std::max(moved, std::abs(1.0 * counts[scan][pad] - counts[0][pad]));
    }
  CHECK(std::sqrt(squares) < 0.5);  // a third of a pad's noise
  CHECK(worst <= 10);
  CHECK(moved > 500);  // ten are a small part of these
  CHECK(squares > 0);  // so it is another computation
}

TEST_CASE("reads in between and poses that are not reached change nothing of a scan") {
  PlantParams params = params_at(Level::quasistatic);
  params.quasistatic_step_s = 27.027027e-3;
  Plant alone = on_jersey(params), looked_at = on_jersey(params);
  follow(alone, [] {});
  follow(looked_at, [&] {
    const ContactState now = looked_at.peek(looked_at.contact().pose, 1e-3);
    CHECK(std::isfinite(now.normal_n));
    (void)looked_at.pad_pressures_pa();
    looked_at.advance({.z_m = std::numeric_limits<double>::quiet_NaN()}, grid_s);
    looked_at.advance({}, -1);
  });
  CHECK(alone.pad_counts() == looked_at.pad_counts());
  CHECK(alone.contact().normal_n == looked_at.contact().normal_n);
}

}  // namespace plant_levels_test
