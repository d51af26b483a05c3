#include "drivers/imprint_array/settings.hpp"

#include <algorithm>
#include <string>

#include "drivers/api/config.hpp"

namespace weft::drivers {

namespace imprint = protocols::imprint;

const char imprint_config_schema[] = R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "Imprint array",
  "type": "object",
  "additionalProperties": false,
  "required": ["rows", "cols"],
  "properties": {
    "rows": {"type": "integer", "minimum": 1, "maximum": 128, "description": "of the part of the array that is scanned"},
    "cols": {"type": "integer", "minimum": 1, "maximum": 128},
    "first_row": {"type": "integer", "minimum": 0, "maximum": 127, "description": "where the part begins; in the middle of the array without it"},
    "first_col": {"type": "integer", "minimum": 0, "maximum": 127},
    "rate_hz": {"x-unit": "Hz", "type": "number", "minimum": 0.1, "maximum": 1000, "default": 5, "description": "scans a second"},
    "serial": {"type": "integer", "minimum": 0, "maximum": 4294967295, "default": 0, "description": "serial number that the array must have; 0: any"},
    "reply_timeout_s": {"x-unit": "s", "type": "number", "minimum": 0.01, "maximum": 60, "default": 3, "description": "for the array's description, which comes once a second, and then for the first scan"},
    "stale_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0.01, "maximum": 60, "description": "five periods of the stream, at least 0.3"},
    "watch_s": {"x-unit": "s", "type": "number", "minimum": 0, "maximum": 3600, "default": 4, "description": "windows in which frozen scans, the rate and the clock are looked for; 0: they are not"}
  }
})";

namespace {

constexpr double last_taxel = imprint::max_side - 1;
constexpr std::int64_t in_the_middle = -1;

std::uint8_t read_side(ConfigReader& config, const char* key) {
  constexpr std::int64_t missing = 0;
  const std::int64_t side = config.integer(key, missing, {1, double{imprint::max_side}});
  if (side == missing) config.refuse(key, "missing", "1 to 128 taxels", "nothing");
  return static_cast<std::uint8_t>(side);
}

std::optional<std::uint8_t> read_first(ConfigReader& config, const char* key) {
  const std::int64_t first = config.integer(key, in_the_middle, {0, last_taxel});
  if (first == in_the_middle) return std::nullopt;
  return static_cast<std::uint8_t>(first);
}

}  // namespace

Result<ImprintSettings> read_imprint_settings(std::string_view config_json) {
  ConfigReader config(config_json);
  ImprintSettings settings;
  settings.rows = read_side(config, "rows");
  settings.cols = read_side(config, "cols");
  settings.first_row = read_first(config, "first_row");
  settings.first_col = read_first(config, "first_col");
  settings.rate_hz = config.number("rate_hz", 5, {0.1, 1e3});
  settings.serial = static_cast<std::uint32_t>(config.integer("serial", 0, {0, 4294967295.0}));
  settings.reply_timeout = from_seconds(config.number("reply_timeout_s", 3, {0.01, 60}));
  settings.stale_after = from_seconds(config.number(
      "stale_after_s", std::min(std::max(0.3, 5 / settings.rate_hz), 60.0), {0.01, 60}));
  settings.watch = from_seconds(config.number("watch_s", 4, {0, 3600}));
  const imprint::Window part{settings.first_row.value_or(0), settings.first_col.value_or(0),
                             settings.rows, settings.cols};
  if (settings.rows > 0 && settings.cols > 0 && !makes_sense(part))
    config.refuse("first_row", "the part goes beyond the largest array",
                  "rows and columns 0 to 127");
  if (Status status = config.finish(); !status) return pass(status.error());
  return settings;
}

Result<imprint::Window> window_on(const ImprintSettings& settings, std::uint8_t rows,
                                  std::uint8_t cols) {
  const auto middle = [](int array, int part) {
    return static_cast<std::uint8_t>(std::max(0, (array - part) / 2));
  };
  const imprint::Window part{settings.first_row.value_or(middle(rows, settings.rows)),
                             settings.first_col.value_or(middle(cols, settings.cols)),
                             settings.rows, settings.cols};
  const auto size = [](int r, int c) { return std::to_string(r) + " x " + std::to_string(c); };
  if (part.first_row + part.rows > rows || part.first_col + part.cols > cols)
    return fail({.code = Errc::device_settings,
                 .where = "/rows",
                 .what = "the array has no such part",
                 .expected = "a part of " + size(rows, cols),
                 .got = size(part.rows, part.cols) + " from row " + std::to_string(part.first_row) +
                        ", column " + std::to_string(part.first_col),
                 .hint = "Correct the rig file, or look which array is on this port"});
  return part;
}

}  // namespace weft::drivers
