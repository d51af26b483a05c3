#include "sim/rig/imprint_config.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "sim/plant/field_reader.hpp"
#include "sim/plant/scene/scene.hpp"

namespace weft::sim {

namespace {

/// Also what shares load between neighbours is a choice of the scene's, by its level.
Result<Level> read_level(const std::string& text, const std::string& where) {
  const auto level = level_from(text);
  if (!level)
    return fail({.code = Errc::parse,
                 .where = where,
                 .what = level.error().what,
                 .expected = "Z or Z+",
                 .got = text});
  if (Status s = check(Scene{"imprint", {Channel::imprint}, {}}, *level); !s)
    return fail({.code = s.error().code,
                 .where = where,
                 .what = s.error().what,
                 .expected = "Z or Z+",
                 .got = text});
  return *level;
}

}  // namespace

Result<ImprintEmulatorParams> read_imprint(const nlohmann::json& emulator,
                                           const std::string& where) {
  ImprintEmulatorParams params;
  std::string kind, level{to_string(params.level)};
  double rate_hz = 5, serial = params.serial, bits = params.taxels.bits, chunk = 0;
  FieldReader reader(emulator, where);
  reader.text("kind", kind).text("level", level).number("rate_hz", rate_hz, 0.1, 1000);
  reader.number("full_scale_pa", params.taxels.full_scale_pa, 1, 1e9).number("bits", bits, 1, 7);
  reader.number("hysteresis", params.taxels.hysteresis, 0, 4);
  reader.number("noise_counts", params.taxels.noise_counts, 0, 100);
  reader.number("serial", serial, 0, 4294967295.0).number("largest_chunk_bytes", chunk, 0, 4096);
  if (Status s = reader.finish(); !s) return pass(s.error());
  const auto read = read_level(level, where + "/level");
  if (!read) return pass(read.error());
  params.level = *read;
  params.taxels.bits = static_cast<int>(bits);
  params.period_ns = std::llround(1e9 / rate_hz);
  params.serial = static_cast<std::uint32_t>(serial);
  params.largest_chunk_bytes = static_cast<std::size_t>(chunk);
  return params;
}

}  // namespace weft::sim
