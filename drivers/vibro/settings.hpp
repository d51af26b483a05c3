#pragma once

#include <cstdint>
#include <string_view>

#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"

namespace weft::drivers {

struct VibroSettings {
  double acceleration_rate_hz = 200;  ///< readings a second; 0: the channel is not looked at
  double sound_rate_hz = 8000;
  std::uint32_t serial = 0;  ///< that the sensor must have; 0: any
  Duration reply_timeout{};  ///< for the sensor's description, which comes once a second
  Duration stale_after{};
  Duration watch{};  ///< windows in which values, rate and clock are judged; zero: they are not
};

/// JSON Schema of the configuration.
extern const char vibro_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<VibroSettings> read_vibro_settings(std::string_view config_json);

}  // namespace weft::drivers
