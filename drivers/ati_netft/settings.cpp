#include "drivers/ati_netft/settings.hpp"

#include <algorithm>

#include "drivers/api/config.hpp"

namespace weft::drivers {

const char netft_config_schema[] = R"({
  "$schema": "http://json-schema.org/draft-07/schema#",
  "title": "ATI force/torque sensor behind a Net F/T box",
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "counts_per_newton": {"type": "number", "minimum": 1, "maximum": 1e9, "default": 1000000, "description": "cfgcpf of the box"},
    "counts_per_newton_metre": {"type": "number", "minimum": 1, "maximum": 1e9, "default": 1000000, "description": "cfgcpt of the box"},
    "sign_z": {"enum": [1, -1], "default": 1, "description": "-1 turns Fz of the device round: pushing the plate down is to be positive"},
    "rated_force_n": {"type": "array", "items": {"type": "number", "minimum": 0.1, "maximum": 10000}, "minItems": 3, "maxItems": 3, "default": [40, 40, 120], "description": "a sample beyond these is marked invalid"},
    "rate_hz": {"type": "number", "minimum": 1, "maximum": 7000, "default": 100, "description": "RDT output rate that the box is set to"},
    "reply_timeout_s": {"type": "number", "minimum": 0.01, "maximum": 60, "default": 0.5},
    "stale_after_s": {"type": "number", "minimum": 0.001, "maximum": 60, "description": "ten periods of the stream, at least 0.1"}
  }
})";

Result<NetftSettings> read_netft_settings(std::string_view config_json) {
  ConfigReader config(config_json);
  NetftSettings settings;
  settings.newton_per_count = 1 / config.number("counts_per_newton", 1e6, {1, 1e9});
  settings.newton_metre_per_count = 1 / config.number("counts_per_newton_metre", 1e6, {1, 1e9});
  settings.sign_z = config.number("sign_z", 1, {-1, 1});
  if (settings.sign_z != 1 && settings.sign_z != -1)
    config.refuse("sign_z", "not a sign", "1 or -1", std::to_string(settings.sign_z));
  const std::vector<double> rated = config.numbers("rated_force_n", {40, 40, 120}, {0.1, 1e4});
  std::copy(rated.begin(), rated.end(), settings.rated_force_n.begin());
  const double rate_hz = config.number("rate_hz", 100, {1, 7000});
  settings.reply_timeout = from_seconds(config.number("reply_timeout_s", 0.5, {0.01, 60}));
  settings.stale_after =
      from_seconds(config.number("stale_after_s", std::max(0.1, 10 / rate_hz), {0.001, 60}));
  if (Status status = config.finish(); !status) return pass(status.error());
  return settings;
}

}  // namespace weft::drivers
