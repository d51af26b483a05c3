#pragma once
// Stages and the scale of their counts. Source: APT16 section 8 and the Thorlabs stage database
// MG17APTServer.ini; docs/reference/device-facts.md, APT scales and APT stage data. Values without
// a source are marked.

#include <cstdint>
#include <span>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::protocols::apt {

/// Counts per natural unit: mm for linear stages, degrees for rotary ones.
struct StageScale {
  double counts_per_unit = 0;      ///< position
  double velocity_counts = 0;      ///< per unit/s
  double acceleration_counts = 0;  ///< per unit/s^2

  bool operator==(const StageScale&) const = default;
};

enum class Axis : std::uint8_t { linear, rotary };
/// Status message of a controller: steppers send 0x0481, servos and brushless drives 0x0491.
enum class Family : std::uint8_t { stepper, servo };

/// A stage with its limits and defaults, in mm or degrees and seconds. The rows are in
/// stage_table.cpp.
struct StageModel {
  std::string_view name;
  Axis axis;
  double travel_low;
  double travel_high;
  double max_speed;
  double max_acceleration;
  double default_speed;
  double default_acceleration;
  double home_speed;
  double home_offset;
  double backlash;                    ///< backlash correction of the database
  std::uint16_t home_direction;       ///< as HomeParams::direction
  std::uint16_t home_limit_switch;    ///< as HomeParams::limit_switch
  std::uint16_t forward_limit;        ///< as LimitSwitchParams::forward_hardware
  std::uint16_t reverse_limit;        ///< as LimitSwitchParams::reverse_hardware
  std::uint16_t stage_id;             ///< in HW_GET_INFO of KDC101/TDC001; 0 if none
  std::string_view usual_controller;  ///< its reported model: "KDC101"
  std::string_view source;            ///< of travel, limits and defaults
  [[nodiscard]] bool is_brushless() const {
    return usual_controller.starts_with("KBD") || usual_controller.starts_with("BBD");
  }
  // Set from the pairing of stage and controller.
  Family family = Family::stepper;
  StageScale scale = {};
};

/// A controller with a known scale for a stage. The scale depends on the controller: an LTS150 has
/// 409600 counts per mm, but 25600 on a BSC10x or a TST001.
struct Pairing {
  std::string_view stage;
  std::string_view prefix;  ///< prefix of the controller's model
  std::string_view name;    ///< display name: "BSC20x"
  StageScale scale;
  std::string_view source;
};

struct Controller {
  std::string_view prefix;  ///< prefix of its model
  Family family;
  bool has_own_stage;  ///< the model names the stage: LTS300, LTS150
  std::uint8_t
      positive_direction;  ///< of MOVE_VELOCITY and MOVE_JOG: direction of increasing counts
  std::int32_t serial;     ///< of an emulated unit
};

std::span<const StageModel> stage_models();
std::span<const Pairing> stage_pairings();
std::span<const Controller> stage_controllers();

/// The stage with its usual controller; nullptr for an unknown name.
const StageModel* find_stage(std::string_view name);
/// The stage on a controller of this model ("BSC201"); nullptr if its scale for the stage is
/// unknown.
const StageModel* find_stage(std::string_view name, std::string_view controller);
/// The controller with this reported model; nullptr if unknown.
const Controller* find_controller(std::string_view model);

/// `value` in mm or degrees. Errors: range, for NaN and for results outside 32 bits.
Result<std::int32_t> position_to_counts(const StageScale& scale, double value);
/// `value` in units/s. Errors: as above.
Result<std::int32_t> velocity_to_counts(const StageScale& scale, double value);
/// `value` in units/s^2. Errors: as above.
Result<std::int32_t> acceleration_to_counts(const StageScale& scale, double value);

constexpr double position_from_counts(const StageScale& scale, std::int32_t counts) {
  return counts / scale.counts_per_unit;
}
constexpr double velocity_from_counts(const StageScale& scale, std::int32_t counts) {
  return counts / scale.velocity_counts;
}
constexpr double acceleration_from_counts(const StageScale& scale, std::int32_t counts) {
  return counts / scale.acceleration_counts;
}

}  // namespace weft::protocols::apt
