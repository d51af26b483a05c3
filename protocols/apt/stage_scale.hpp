#pragma once
// Stages and the scale of their counts. Source: APT16 section 8 and the Thorlabs stage database
// MG17APTServer.ini; docs/reference/device-facts.md, APT scales and APT stage data. A value
// without a source is marked so here.

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
/// Which status messages a controller speaks: steppers 0x0481, servos and brushless drives 0x0491.
enum class Family : std::uint8_t { stepper, servo };

/// A stage, its limits and defaults in mm or degrees and seconds. stage_table.cpp has the rows.
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
  double backlash;                    ///< the database's backlash correction
  std::uint16_t home_direction;       ///< as HomeParams::direction
  std::uint16_t home_limit_switch;    ///< as HomeParams::limit_switch
  std::uint16_t forward_limit;        ///< as LimitSwitchParams::forward_hardware
  std::uint16_t reverse_limit;        ///< as LimitSwitchParams::reverse_hardware
  std::uint16_t stage_id;             ///< in HW_GET_INFO of KDC101/TDC001; 0 where there is none
  std::string_view usual_controller;  ///< the model that it reports: "KDC101"
  std::string_view source;            ///< of travel, limits and defaults
  [[nodiscard]] bool is_brushless() const {
    return usual_controller.starts_with("KBD") || usual_controller.starts_with("BBD");
  }
  // Those of a pairing.
  Family family = Family::stepper;
  StageScale scale = {};
};

/// A controller with a known scale for a stage. It counts otherwise on others: 25600 to the mm, not
/// 409600, on a BSC10x or a TST001.
struct Pairing {
  std::string_view stage;
  std::string_view prefix;  ///< what the controller's model begins with
  std::string_view name;    ///< in texts: "BSC20x"
  StageScale scale;
  std::string_view source;
};

struct Controller {
  std::string_view prefix;  ///< what its model begins with
  Family family;
  bool has_own_stage;               ///< the model names the stage: an LTS300 is not an LTS150
  std::uint8_t positive_direction;  ///< of MOVE_VELOCITY and MOVE_JOG: counts increase
  std::int32_t serial;              ///< of an emulated unit
};

std::span<const StageModel> stage_models();
std::span<const Pairing> stage_pairings();
std::span<const Controller> stage_controllers();

/// With its usual controller; nullptr for a name that the table does not have.
const StageModel* find_stage(std::string_view name);
/// At a controller of this model ("BSC201"); nullptr where its scale for the stage is not known.
const StageModel* find_stage(std::string_view name, std::string_view controller);
/// By the model that it reports; nullptr for another kind.
const Controller* find_controller(std::string_view model);

/// `value` in mm or degrees. Errors: range, for NaN and for what does not fit 32 bits.
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
