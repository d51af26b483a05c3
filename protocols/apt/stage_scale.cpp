#include "protocols/apt/stage_scale.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace weft::protocols::apt {
namespace {

// LTS150: database entry "HS LTS150"; scale of APT16 for Trinamic controllers (409600 per mm, times
// 53.68 for velocity, over 90.9 for acceleration).
constexpr StageModel lts150{.name = "LTS150",
                            .axis = Axis::linear,
                            .family = Family::stepper,
                            .scale = {409600, 21987328, 4506},
                            .travel_low = 0,
                            .travel_high = 150,
                            .max_speed = 50,
                            .max_acceleration = 50,
                            .default_speed = 20,
                            .default_acceleration = 20,
                            .home_speed = 2,
                            .home_offset = 0.5,
                            .backlash = 0.05,
                            .home_direction = 2,
                            .home_limit_switch = 1,
                            .forward_limit = 2,
                            .reverse_limit = 2,
                            .stage_id = 0};

// PRM1-Z8: 512 counts a turn, gear 67, pitch 17.87; scale of APT16 and pylablib. The database does
// not give its homing direction and switch: those of the LTS are used (M).
constexpr StageModel prm1_z8{.name = "PRM1-Z8",
                             .axis = Axis::rotary,
                             .family = Family::servo,
                             .scale = {1919.6418578623391, 42941.66, 14.66},
                             .travel_low = 0,
                             .travel_high = 360,
                             .max_speed = 25,
                             .max_acceleration = 25,
                             .default_speed = 10,
                             .default_acceleration = 10,
                             .home_speed = 10,
                             .home_offset = 4,
                             .backlash = 1,
                             .home_direction = 2,
                             .home_limit_switch = 1,
                             .forward_limit = 4,
                             .reverse_limit = 1,
                             .stage_id = 6};

constexpr std::array models = [] {
  StageModel nrt150 = lts150;  // "HS NRT150" on a BSC20x
  nrt150.name = "NRT150";
  nrt150.default_speed = nrt150.default_acceleration = 30;
  nrt150.home_speed = 1;
  nrt150.home_offset = nrt150.backlash = 0.1;

  StageModel cr1_z7 = prm1_z8;  // 48 counts x gear 256 / 7.5 degrees of pitch
  cr1_z7.name = "CR1-Z7";
  cr1_z7.scale = {1638.4, 36650.4, 12.51};
  cr1_z7.max_speed = 6;
  cr1_z7.max_acceleration = 5;
  cr1_z7.default_speed = cr1_z7.default_acceleration = 4;
  cr1_z7.home_speed = 2;
  cr1_z7.home_offset = 0.2;
  cr1_z7.stage_id = 5;

  StageModel k10cr1 = lts150;  // scale and limits of QMI; homing speed as PRM1-Z8 (M)
  k10cr1.name = "K10CR1";
  k10cr1.axis = Axis::rotary;
  k10cr1.scale = {409600.0 / 3.0, 7329109, 1502};
  k10cr1.travel_high = 360;
  k10cr1.max_speed = k10cr1.default_speed = 10;
  k10cr1.max_acceleration = k10cr1.default_acceleration = 20;
  k10cr1.home_speed = 10;
  k10cr1.home_offset = 4;
  return std::array{lts150, nrt150, prm1_z8, cr1_z7, k10cr1};
}();

Result<std::int32_t> to_counts(double value, double counts_per_value, const char* what) {
  const double counts = std::round(value * counts_per_value);
  constexpr double lowest = std::numeric_limits<std::int32_t>::min();
  constexpr double highest = std::numeric_limits<std::int32_t>::max();
  if (counts >= lowest && counts <= highest) return static_cast<std::int32_t>(counts);
  return fail({.code = Errc::range,
               .what = std::string(what) + " does not fit the 32-bit field of the protocol",
               .expected = "up to " + std::to_string(highest / counts_per_value),
               .got = std::to_string(value)});
}

}  // namespace

std::span<const StageModel> stage_models() {
  return models;
}

const StageModel* find_stage(std::string_view name) {
  for (const StageModel& model : models)
    if (model.name == name) return &model;
  return nullptr;
}

Result<std::int32_t> position_to_counts(const StageScale& scale, double value) {
  return to_counts(value, scale.counts_per_unit, "position");
}

Result<std::int32_t> velocity_to_counts(const StageScale& scale, double value) {
  return to_counts(value, scale.velocity_counts, "velocity");
}

Result<std::int32_t> acceleration_to_counts(const StageScale& scale, double value) {
  return to_counts(value, scale.acceleration_counts, "acceleration");
}

}  // namespace weft::protocols::apt
