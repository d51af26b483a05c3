#include "drivers/ati_digital/settings.hpp"

#include <algorithm>
#include <string>

#include "drivers/api/config.hpp"

namespace weft::drivers {

const char digital_config_schema[] = R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "ATI Digital force/torque sensor",
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "slave": {"type": "integer", "minimum": 1, "maximum": 247, "default": 10, "description": "Modbus address"},
    "calibration": {"type": "integer", "minimum": 1, "maximum": 16, "default": 1, "description": "which of the sensor's calibrations"},
    "sign_z": {"x-safety": true, "enum": [1, -1], "default": 1, "description": "-1 turns Fz of the device round: pushing the plate down is to be positive"},
    "rate_hz": {"x-unit": "Hz", "type": "number", "minimum": 1, "maximum": 7000, "default": 100, "description": "samples a second: records a second divided by average"},
    "average": {"type": "integer", "minimum": 1, "maximum": 7000, "default": 1, "description": "records of the stream whose mean is a sample; the sensor sends about 7000 a second at 1.25 Mbaud"},
    "calibration_serial": {"x-safety": true, "type": "string", "maxLength": 8, "description": "of the calibration in the sensor; another is refused"},
    "stuck_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0, "maximum": 3600, "default": 1, "description": "gauges that all stay the same for so long are a fault, because a real sensor has noise; 0: never"},
    "reply_timeout_s": {"x-unit": "s", "type": "number", "minimum": 0.01, "maximum": 60, "default": 0.2},
    "stale_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0.001, "maximum": 60, "description": "ten samples, at least 0.1"}
  }
})";

Result<DigitalSettings> read_digital_settings(std::string_view config_json) {
  ConfigReader config(config_json);
  DigitalSettings settings;
  settings.slave = static_cast<std::uint8_t>(config.integer("slave", 10, {1, 247}));
  settings.calibration = static_cast<int>(config.integer("calibration", 1, {1, 16}));
  settings.sign_z = config.number("sign_z", 1, {-1, 1});
  if (settings.sign_z != 1 && settings.sign_z != -1)
    config.refuse("sign_z", "not a sign", "1 or -1", std::to_string(settings.sign_z));
  settings.average = static_cast<std::uint32_t>(config.integer("average", 1, {1, 7000}));
  const double rate_hz = config.number("rate_hz", 100, {1, 7000});
  settings.rate_hz = rate_hz;
  settings.calibration_serial = config.text("calibration_serial", "");
  settings.stuck_after = from_seconds(config.number("stuck_after_s", 1, {0, 3600}));
  settings.reply_timeout = from_seconds(config.number("reply_timeout_s", 0.2, {0.01, 60}));
  settings.stale_after =
      from_seconds(config.number("stale_after_s", std::max(0.1, 10 / rate_hz), {0.001, 60}));
  if (Status status = config.finish(); !status) return pass(status.error());
  return settings;
}

}  // namespace weft::drivers
