#pragma once
// The configuration of one stage, checked and converted to SI and counts.

#include <cstdint>
#include <string>
#include <string_view>

#include "drivers/api/driver.hpp"
#include "protocols/apt/bodies.hpp"
#include "protocols/apt/stage_scale.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"

namespace weft::drivers {

/// Lengths in m or rad, from home; speeds in m/s or rad/s.
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
  std::int32_t default_velocity_counts = 0;  ///< used until the first motion with a speed
  std::int32_t travel_low_counts = 0;
  std::int32_t travel_high_counts = 0;
  /// Largest distance of a finished move from its target.
  std::int32_t in_position_counts = 4;
  bool require_homed = true;
  std::int32_t serial = 0;  ///< required serial number; 0: any
  bool identify = false;    ///< the front panel flashes on opening
  /// Steppers: the status has the encoder's position of the carriage.
  bool encoder = false;
  std::int32_t encoder_tolerance_counts = 0;
  bool check_jumps = true;     ///< drop readings that no motion explains
  bool home_must_move = true;  ///< a homing without a change of position is a fault
  Duration home_timeout{};
  Duration reply_timeout{};
  Duration poll_period{};  ///< zero: only on PollCommand

  /// A length [m] or an angle [rad] in the unit of the rig file: "12.3456 mm", "4.0000 deg".
  [[nodiscard]] std::string with_unit(double si) const;
};

/// JSON Schema of the configuration.
extern const char stage_config_schema[];

/// Errors: parse, invalid_argument (key, type, unknown stage), range; each at its JSON pointer.
Result<StageSettings> read_stage_settings(std::string_view config_json);

// Check that the connected unit is the configured one.

/// Compares the controller's model, its stage id and its channels with the settings, and checks
/// that the stage's scale on that controller is known. Errors: device_identity or device_settings,
/// with both values.
Status check_identity(const StageSettings& settings, const protocols::apt::HardwareInfo& info);

/// The controller's reported identity, and the scale of its counts.
DeviceIdentity identity_of(const StageSettings& settings, const protocols::apt::HardwareInfo& info);

}  // namespace weft::drivers
