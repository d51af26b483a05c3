#include "drivers/ati_netft/settings.hpp"

#include <algorithm>

#include "drivers/api/config.hpp"

namespace weft::drivers {

namespace {
constexpr double not_given = 0;
constexpr double usual_counts = 1e6;  // cfgcpf and cfgcpt of nearly every box
}  // namespace

const char netft_config_schema[] = R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "ATI force/torque sensor behind a Net F/T box",
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "counts_per_newton": {"x-unit": "1/N", "type": "number", "minimum": 1, "maximum": 1e9, "default": 1000000, "description": "cfgcpf of the box"},
    "counts_per_newton_metre": {"x-unit": "1/N/m", "type": "number", "minimum": 1, "maximum": 1e9, "default": 1000000, "description": "cfgcpt of the box"},
    "sign_z": {"x-safety": true, "enum": [1, -1], "default": 1, "description": "-1 turns Fz of the device round: pushing the plate down is to be positive"},
    "rated_force_n": {"x-unit": "N", "x-safety": true, "type": "array", "items": {"type": "number", "minimum": 0.1, "maximum": 10000}, "minItems": 3, "maxItems": 3, "default": [40, 40, 120], "description": "a sample beyond these is marked invalid"},
    "rate_hz": {"x-unit": "Hz", "type": "number", "minimum": 1, "maximum": 7000, "default": 100, "description": "RDT output rate that the box is set to"},
    "reply_timeout_s": {"x-unit": "s", "type": "number", "minimum": 0.01, "maximum": 60, "default": 0.5},
    "calibration_serial": {"x-safety": true, "type": "string", "maxLength": 64, "description": "of the box's calibration page; another is refused; needs the device's http link"},
    "stuck_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0, "maximum": 3600, "default": 1, "description": "six values that stay the same for so long are a fault, because a real sensor has noise; 0: never"},
    "stale_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0.001, "maximum": 60, "description": "ten periods of the stream, at least 0.1"}
  }
})";

Result<NetftSettings> read_netft_settings(std::string_view config_json) {
  ConfigReader config(config_json);
  NetftSettings settings;
  const double per_n = config.number("counts_per_newton", not_given, {1, 1e9});
  const double per_nm = config.number("counts_per_newton_metre", not_given, {1, 1e9});
  settings.force_scale_given = per_n != not_given;
  settings.torque_scale_given = per_nm != not_given;
  settings.newton_per_count = 1 / (settings.force_scale_given ? per_n : usual_counts);
  settings.newton_metre_per_count = 1 / (settings.torque_scale_given ? per_nm : usual_counts);
  settings.calibration_serial = config.text("calibration_serial", "");
  settings.sign_z = config.number("sign_z", 1, {-1, 1});
  if (settings.sign_z != 1 && settings.sign_z != -1)
    config.refuse("sign_z", "not a sign", "1 or -1", std::to_string(settings.sign_z));
  const std::vector<double> rated = config.numbers("rated_force_n", {40, 40, 120}, {0.1, 1e4});
  std::copy(rated.begin(), rated.end(), settings.rated_force_n.begin());
  const double rate_hz = config.number("rate_hz", 100, {1, 7000});
  settings.rate_hz = rate_hz;
  settings.stuck_after = from_seconds(config.number("stuck_after_s", 1, {0, 3600}));
  settings.reply_timeout = from_seconds(config.number("reply_timeout_s", 0.5, {0.01, 60}));
  settings.stale_after =
      from_seconds(config.number("stale_after_s", std::max(0.1, 10 / rate_hz), {0.001, 60}));
  if (Status status = config.finish(); !status) return pass(status.error());
  return settings;
}

}  // namespace weft::drivers
