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
};

enum class Axis : std::uint8_t { linear, rotary };
/// Which status messages a controller speaks: steppers 0x0481, servos 0x0491.
enum class Family : std::uint8_t { stepper, servo };

struct StageModel {
  std::string_view name;
  Axis axis;
  Family family;
  StageScale scale;
  // Limits and defaults of the stage database, in mm or degrees and seconds.
  double travel_low;
  double travel_high;
  double max_speed;
  double max_acceleration;
  double default_speed;
  double default_acceleration;
  double home_speed;
  double home_offset;
  double backlash;                  ///< the database's backlash correction
  std::uint16_t home_direction;     ///< as HomeParams::direction
  std::uint16_t home_limit_switch;  ///< as HomeParams::limit_switch
  std::uint16_t forward_limit;      ///< as LimitSwitchParams::forward_hardware
  std::uint16_t reverse_limit;      ///< as LimitSwitchParams::reverse_hardware
  std::uint16_t stage_id;           ///< in HW_GET_INFO of KDC101/TDC001; 0 where there is none
};

std::span<const StageModel> stage_models();

/// nullptr for a name that the table does not have.
const StageModel* find_stage(std::string_view name);

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
