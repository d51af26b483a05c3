#include "drivers/vibro/settings.hpp"

#include "drivers/api/config.hpp"

namespace weft::drivers {

const char vibro_config_schema[] = R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "Vibration sensor",
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "acceleration_rate_hz": {"x-unit": "Hz", "type": "number", "minimum": 0, "maximum": 100000, "default": 200, "description": "readings a second of the accelerometer; 0: it is not looked at"},
    "sound_rate_hz": {"x-unit": "Hz", "type": "number", "minimum": 0, "maximum": 400000, "default": 8000, "description": "readings a second of the microphone; 0: it is not looked at"},
    "serial": {"type": "integer", "minimum": 0, "maximum": 4294967295, "default": 0, "description": "serial number that the sensor must have; 0: any"},
    "reply_timeout_s": {"x-unit": "s", "type": "number", "minimum": 0.01, "maximum": 60, "default": 3, "description": "for the sensor's description, which comes once a second"},
    "stale_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0.01, "maximum": 60, "default": 0.3, "description": "a channel that is silent for so long is a fault"},
    "watch_s": {"x-unit": "s", "type": "number", "minimum": 0, "maximum": 3600, "default": 2, "description": "windows in which frozen and saturated values, the rate and the clock are looked for; 0: they are not"}
  }
})";

Result<VibroSettings> read_vibro_settings(std::string_view config_json) {
  ConfigReader config(config_json);
  VibroSettings settings;
  settings.acceleration_rate_hz = config.number("acceleration_rate_hz", 200, {0, 1e5});
  settings.sound_rate_hz = config.number("sound_rate_hz", 8000, {0, 4e5});
  settings.serial = static_cast<std::uint32_t>(config.integer("serial", 0, {0, 4294967295.0}));
  settings.reply_timeout = from_seconds(config.number("reply_timeout_s", 3, {0.01, 60}));
  settings.stale_after = from_seconds(config.number("stale_after_s", 0.3, {0.01, 60}));
  settings.watch = from_seconds(config.number("watch_s", 2, {0, 3600}));
  if (settings.acceleration_rate_hz == 0 && settings.sound_rate_hz == 0)
    config.refuse("sound_rate_hz", "no channel is looked at", "a rate above 0 for one of them",
                  "0 for both");
  if (Status status = config.finish(); !status) return pass(status.error());
  return settings;
}

}  // namespace weft::drivers
