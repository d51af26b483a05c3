#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"

namespace weft::drivers {

struct DigitalSettings {
  std::uint8_t slave = 10;
  int calibration = 1;  ///< 1 to 16, of those that the sensor holds
  /// Fz of the sample = sign_z * Fz of the device. +1 where pushing the plate down is positive.
  double sign_z = 1;
  double rate_hz = 100;       ///< samples a second
  std::uint32_t average = 1;  ///< records of the stream whose mean is a sample
  Duration reply_timeout{};   ///< of each of a few tries of a request
  Duration stale_after{};
  Duration stuck_after{};          ///< zero: never
  std::string calibration_serial;  ///< empty: any
};

/// JSON Schema of the configuration.
extern const char digital_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<DigitalSettings> read_digital_settings(std::string_view config_json);

}  // namespace weft::drivers
