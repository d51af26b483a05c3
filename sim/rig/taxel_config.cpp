#include "sim/rig/taxel_config.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "protocols/taxel/taxel.hpp"
#include "sim/plant/field_reader.hpp"

namespace weft::sim {
namespace {

using nlohmann::json;

/// [x1, y1, x2, y2, ...] on the face.
Status read_places(const json& list, const std::string& where, TaxelEmulatorParams& params) {
  constexpr std::size_t most = 2 * protocols::taxel::max_taxels;
  const bool good = list.is_array() && list.size() % 2 == 0 && list.size() <= most &&
                    std::ranges::all_of(list, [](const json& v) {
                      return v.is_number() && std::abs(v.get<double>()) <= 1000;
                    });
  if (!good || list.empty())
    return parse_error(where, {.what = "taxel positions invalid",
                               .expected = "x and y [mm] of 1 to 64 taxels in one list"});
  for (std::size_t i = 0; i < list.size(); i += 2)
    params.places.push_back(
        {list[i].get<double>() * m_per_mm, list[i + 1].get<double>() * m_per_mm});
  return {};
}

/// Reads the shape of an array that differs from the plant's 4 x 4 pads at 37 Hz.
Status read_shape(const json& emulator, const std::string& where, FieldReader& reader,
                  TaxelEmulatorParams& params) {
  std::size_t rows = 4, cols = 4;
  double rate_hz = 0;
  reader.whole("rows", rows, 1, 64).whole("cols", cols, 1, 64);
  reader.number("rate_hz", rate_hz, 0.1, 1000);
  reader.number("noise_counts", params.noise_counts, 0, 1000).ignore("positions_mm");
  if (rows * cols > protocols::taxel::max_taxels)
    return parse_error(where + "/rows", {.what = "too many taxels",
                                         .expected = "rows x cols of at most 64",
                                         .got = std::to_string(rows * cols)});
  if (rate_hz > 0) params.period_ns = static_cast<std::int64_t>(std::llround(1e9 / rate_hz));
  if (emulator.contains("positions_mm"))
    return read_places(emulator["positions_mm"], where + "/positions_mm", params);
  if (rate_hz > 0 || rows != 4 || cols != 4) params.places = taxel_grid(rows, cols);
  return {};
}

}  // namespace

Result<TaxelEmulatorParams> read_taxels(const json& emulator, const std::string& where) {
  TaxelEmulatorParams params;
  std::string form = "weft";
  FieldReader reader(emulator, where);
  reader.ignore("kind").text("form", form);
  reader.whole("largest_chunk_bytes", params.largest_chunk_bytes, 0, 4096);
  if (Status s = read_shape(emulator, where, reader, params); !s) return pass(s.error());
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (form == "cpm_udp" && !params.places.empty())
    return parse_error(where + "/form", {.what = "form cpm_udp not allowed with taxel positions",
                                         .expected = "form weft",
                                         .got = form});
  if (form != "weft" && form != "cpm_udp")
    return parse_error(where + "/form",
                       {.what = "form unknown", .expected = "weft or cpm_udp", .got = form});
  params.wire = form == "weft" ? TaxelWire::weft : TaxelWire::cpm_udp;
  return params;
}

}  // namespace weft::sim
