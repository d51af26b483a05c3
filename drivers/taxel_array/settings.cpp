#include "drivers/taxel_array/settings.hpp"

#include <algorithm>

#include "drivers/api/config.hpp"
#include "protocols/taxel/cpm_finger.hpp"
#include "protocols/taxel/taxel.hpp"

namespace weft::drivers {

const char taxel_config_schema[] = R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "Tactile array",
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "taxels": {"type": "integer", "minimum": 1, "maximum": 64, "default": 16},
    "form": {"enum": ["weft", "cpm_udp"], "default": "weft", "description": "weft: serial frames of protocols/taxel; cpm_udp: datagrams of the CPM-Finger's gateway, 16 taxels"},
    "reply_timeout_s": {"x-unit": "s", "type": "number", "minimum": 0.01, "maximum": 60, "default": 1, "description": "for the first frame"},
    "rate_hz": {"x-unit": "Hz", "type": "number", "minimum": 0.1, "maximum": 10000, "default": 37, "description": "frames a second that the sensor sends"},
    "watch_s": {"x-unit": "s", "type": "number", "minimum": 0, "maximum": 3600, "default": 2, "description": "windows in which dead, saturated and noisy taxels, the rate and the clock are looked for; 0: they are not"},
    "stale_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0.01, "maximum": 60, "description": "ten periods of the stream, at least 0.3"}
  }
})";

Result<TaxelSettings> read_taxel_settings(std::string_view config_json) {
  ConfigReader config(config_json);
  TaxelSettings settings;
  settings.taxels = static_cast<std::uint8_t>(
      config.integer("taxels", 16, {1, double{protocols::taxel::max_taxels}}));
  if (config.choice("form", "weft", {"weft", "cpm_udp"}) == "cpm_udp")
    settings.form = TaxelForm::cpm_udp;
  if (settings.form == TaxelForm::cpm_udp && settings.taxels != protocols::taxel::cpm::taxels)
    config.refuse("taxels", "the CPM-Finger has another number", "16",
                  std::to_string(settings.taxels));
  const double rate_hz = config.number("rate_hz", 37, {0.1, 1e4});
  settings.rate_hz = rate_hz;
  settings.watch = from_seconds(config.number("watch_s", 2, {0, 3600}));
  settings.reply_timeout = from_seconds(config.number("reply_timeout_s", 1, {0.01, 60}));
  settings.stale_after = from_seconds(
      config.number("stale_after_s", std::min(std::max(0.3, 10 / rate_hz), 60.0), {0.01, 60}));
  if (Status status = config.finish(); !status) return pass(status.error());
  return settings;
}

}  // namespace weft::drivers
