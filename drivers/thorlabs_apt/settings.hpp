#pragma once
// The configuration of one stage, checked and turned into SI and counts once.

#include <cstdint>
#include <string>
#include <string_view>

#include "drivers/api/driver.hpp"
#include "protocols/apt/bodies.hpp"
#include "protocols/apt/stage_scale.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"

namespace weft::drivers {

/// Lengths are m or rad, from home; speeds m/s or rad/s.
struct StageSettings {
  const protocols::apt::StageModel* model = nullptr;
  protocols::apt::Family family = protocols::apt::Family::stepper;
  /// Counts per SI unit, not per mm or degree.
  protocols::apt::StageScale scale;
  std::uint8_t channel = 1;
  std::uint8_t destination = 0x50;
  double max_speed = 0;
  double acceleration = 0;
  std::int32_t acceleration_counts = 0;
  std::int32_t max_velocity_counts = 0;
  std::int32_t default_velocity_counts = 0;  ///< until the first motion names a speed
  std::int32_t travel_low_counts = 0;
  std::int32_t travel_high_counts = 0;
  /// A finished move may be this far from its target.
  std::int32_t in_position_counts = 4;
  bool require_homed = true;
  std::int32_t serial = 0;  ///< another unit is refused; 0: any
  bool identify = false;    ///< the front panel flashes on opening
  /// Steppers: the status tells where an encoder sees the carriage.
  bool encoder = false;
  std::int32_t encoder_tolerance_counts = 0;
  bool check_jumps = true;     ///< readings that no motion explains are dropped
  bool home_must_move = true;  ///< a homing during which the position never changed is a fault
  Duration home_timeout{};
  Duration reply_timeout{};
  Duration poll_period{};  ///< zero: only on PollCommand

  /// A length [m] or an angle [rad] of the stage as the rig file has it: "12.3456 mm", "4.0000
  /// deg".
  [[nodiscard]] std::string with_unit(double si) const;
};

/// JSON Schema of the configuration.
extern const char stage_config_schema[];

/// Errors: parse, invalid_argument (key, type, unknown stage), range; each at its JSON pointer.
Result<StageSettings> read_stage_settings(std::string_view config_json);

// Is the unit at the other end the one that the configuration means?

/// Compares the controller's model, its stage id and its channels with the settings, and whether
/// the stage's scale on that controller is known. Errors: device, naming both sides.
Status check_identity(const StageSettings& settings, const protocols::apt::HardwareInfo& info);

/// What the controller says of itself, and the scale of its counts.
DeviceIdentity identity_of(const StageSettings& settings, const protocols::apt::HardwareInfo& info);

}  // namespace weft::drivers
