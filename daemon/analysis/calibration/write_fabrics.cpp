#include "daemon/analysis/calibration/write_fabrics.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <nlohmann/json.hpp>

namespace weft::daemon::calibration {
namespace {

using nlohmann::ordered_json;

constexpr std::string_view table_format = "weft-fabrics-2";
constexpr double written_per_m_per_mm = 1e3;
constexpr std::size_t longest_line = 118;

/// Four digits: equal on all compilers, and sufficient for every statistic.
double rounded(double value) {
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 4);
  double out = value;
  std::from_chars(text.data(), end.ptr, out);
  return out;
}

/// Sections of the table for the common parameters.
struct Place {
  std::string_view parameter, section, level;
};
constexpr Place places[] = {
    {"path_mm", "spread", "touch"},      {"pad_ratio", "spread", "touch"},
    {"tilt_mrad", "spread", "mounting"}, {"pad_height_um", "spread", "mounting"},
    {"common_mode", "sensor", ""},       {"common_mode_time_s", "sensor", ""},
    {"drift_counts", "sensor", ""},      {"gain_spread", "sensor", ""},
    {"noise_counts", "sensor", ""},      {"noise_per_count", "sensor", ""},
    {"noise_per_square", "sensor", ""},  {"cover_um", "parameters", ""}};

const CalibratedParameter* find_parameter(const CalibrationResult& result, std::string_view name,
                                          std::string_view cloth = {}) {
  const auto at = std::ranges::find_if(result.parameters, [&](const CalibratedParameter& p) {
    return p.parameter.name == name && p.parameter.cloth == cloth;
  });
  return at == result.parameters.end() ? nullptr : &*at;
}

/// Factor from counts of the recorded sensor to counts of the plant's, used in the table.
double per_count(std::string_view name, double scale) {
  const bool is_in_counts =
      name == "noise_counts" || name == "noise_per_count" || name == "drift_counts";
  return is_in_counts ? 1 / scale : 1;
}

ordered_json with_standing(const CalibratedParameter& p, const std::string& key, double scale) {
  const double factor = per_count(p.parameter.name, scale);
  const double value = rounded(p.value * factor);
  if (p.standing == Standing::estimated) return {value, "estimated"};
  return {value, std::string(to_string(p.standing)), key,
          ordered_json::array({rounded(p.low * factor), rounded(p.high * factor)})};
}

/// True if an earlier calibration determined the value.
bool is_fitted_value(const ordered_json& level, std::string_view parameter) {
  const auto at = level.find(std::string(parameter));
  return at != level.end() && at->is_array() && at->size() == 4 && (*at)[1] != "not_seen";
}

void set_common(ordered_json& table, const CalibrationResult& result, const std::string& key) {
  for (const Place& place : places) {
    const CalibratedParameter* p = find_parameter(result, place.parameter);
    ordered_json& section = table[std::string(place.section)];
    ordered_json& level = place.level.empty() ? section : section[std::string(place.level)];
    if (p->standing == Standing::not_seen && is_fitted_value(level, place.parameter)) continue;
    level[std::string(place.parameter)] = with_standing(*p, key, result.scale);
  }
  // An older table's spread of trials would be read after these and replace them.
  if (table.contains("trial_spread")) table["trial_spread"].erase("tilt_mrad");
}

ordered_json structure_json(const sim::Structure& structure) {
  ordered_json lines = ordered_json::array();
  for (const sim::Structure::Line& line : structure.lines)
    lines.push_back({{"warp", line.warp},
                     {"weft", line.weft},
                     {"share", line.share},
                     {"phase_rad", line.phase_rad}});
  return {
      {"standing", "estimated"},
      {"lines", std::move(lines)},
      {"isotropic_share", structure.isotropic_share},
      {"streak_share", structure.streak_share},
      {"band_per_mm",
       {structure.low_per_m / written_per_m_per_mm, structure.high_per_m / written_per_m_per_mm}},
      {"jitter_rad", structure.jitter_rad}};
}

/// The format has no standing for shares and band, so the note holds it.
ordered_json calibrated_structure(const CalibrationResult& result, const BaseCloth& cloth,
                                  const std::string& key) {
  const CalibratedParameter& band = *find_parameter(result, "band_low_per_mm", cloth.label);
  const CalibratedParameter* lines = find_parameter(result, "line_share", cloth.label);
  ordered_json out =
      structure_json(reshaped(cloth.fabric.structure, lines == nullptr ? 0 : lines->value,
                              band.value * written_per_m_per_mm));
  out["note"] = {{"band_low_per_mm", with_standing(band, key, 1)}};
  if (lines != nullptr) out["note"]["line_share"] = with_standing(*lines, key, 1);
  return out;
}

void add_cloth(ordered_json& table, const CalibrationResult& result, const BaseCloth& cloth,
               const std::string& name, const std::string& key) {
  ordered_json& fabrics = table["fabrics"];
  const auto named = [&](const std::string& wanted) {
    return std::ranges::find_if(fabrics,
                                [&](const ordered_json& row) { return row["name"] == wanted; });
  };
  ordered_json row = *named(cloth.taken);
  row["name"] = name;
  row["structure"] = name;
  row["construction"] = "as " + cloth.taken + "; height and structure from calibration " + key;
  row["height_um"] = with_standing(*find_parameter(result, "height_um", cloth.label), key, 1);
  row["waviness_um"] = with_standing(*find_parameter(result, "waviness_um", cloth.label), key, 1);
  table["structures"][name] = calibrated_structure(result, cloth, key);
  if (const auto before = named(name); before != fabrics.end())
    *before = std::move(row);
  else
    fabrics.push_back(std::move(row));
}

ordered_json natural(const std::optional<double>& value, Scale scale) {
  return value ? ordered_json(rounded(from_scale(*value, scale))) : ordered_json();
}

ordered_json statistic_json(const ComparedStatistic& s) {
  const Scale scale = s.real.scale;
  return {{"name", s.real.name},
          {"cloth", s.real.cloth},
          {"fitted", s.is_fitted},
          {"real", rounded(s.real.shown)},
          {"interval", {rounded(from_scale(s.low, scale)), rounded(from_scale(s.high, scale))}},
          {"before", natural(s.before, scale)},
          {"after", natural(s.after, scale)}};
}

ordered_json held_out_json(const CalibrationResult& result) {
  const HeldOutCheck& check = result.held_out;
  ordered_json rows = ordered_json::array();
  for (const HeldOutStatistic& s : check.statistics)
    rows.push_back(
        {{"name", s.real.name},
         {"cloth", s.real.cloth},
         {"real", rounded(s.real.shown)},
         {"band",
          {rounded(from_scale(s.low, s.real.scale)), rounded(from_scale(s.high, s.real.scale))}},
         {"inside", s.is_inside}});
  return {{"checked", check.is_checked()},
          {"passes", check.passes()},
          {"strokes", result.held_out_strokes},
          {"inside", check.inside},
          {"statistics", std::move(rows)}};
}

ordered_json parameter_json(const CalibratedParameter& p) {
  return {{"name", p.parameter.name},
          {"cloth", p.parameter.cloth},
          {"standing", std::string(to_string(p.standing))},
          {"value", p.value},
          {"interval", {p.low, p.high}},
          {"estimate_before", rounded(p.parameter.start)},
          {"bounds", {p.parameter.low, p.parameter.high}},
          {"bounds_because", p.parameter.reason}};
}

std::string quoted(const std::string& text) {
  return ordered_json(text).dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

/// The value on one line.
std::string spaced(const ordered_json& value) {
  if (!value.is_structured())
    return value.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
  std::string out;
  for (const auto& [key, child] : value.items()) {
    if (!out.empty()) out += ", ";
    if (value.is_object()) out += quoted(key) + ": ";
    out += spaced(child);
  }
  return value.is_object() ? "{" + out + "}" : "[" + out + "]";
}

std::string laid_out(const ordered_json& value, std::size_t indent) {
  std::string one = spaced(value);
  if (!value.is_structured() || indent + one.size() <= longest_line) return one;
  const std::string margin(indent + 2, ' ');
  std::string out;
  for (const auto& [key, child] : value.items()) {
    out += (out.empty() ? "\n" : ",\n") + margin;
    if (value.is_object()) out += quoted(key) + ": ";
    out += laid_out(child, indent + 2);
  }
  out += "\n" + std::string(indent, ' ');
  return value.is_object() ? "{" + out + "}" : "[" + out + "]";
}

}  // namespace

std::string table_text(const ordered_json& table) {
  return laid_out(table, 0) + "\n";
}

std::string next_calibration(const ordered_json& table) {
  for (std::size_t i = 1;; ++i) {
    std::string key = "C" + std::to_string(i);
    const bool is_taken = (table.contains("calibrations") && table["calibrations"].contains(key)) ||
                          (table.contains("sources") && table["sources"].contains(key));
    if (!is_taken) return key;
  }
}

std::string name_in_table(const std::string& prefix, const std::string& label) {
  std::string out = prefix.empty() ? label : prefix + "." + label;
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

ordered_json calibration_json(const CalibrationResult& result, const CalibrationSource& source) {
  ordered_json out = {{"bench", "simulated"},
                      {"passes", result.held_out.passes()},
                      {"files", source.files},
                      {"dataset_sha256", source.dataset_sha256},
                      {"recordings_bench", std::string(to_string(source.bench))},
                      {"held_out_file", source.held_out_file},
                      {"fitted_strokes", result.fitted_strokes},
                      {"simulated_strokes", result.simulated_strokes},
                      {"software_version", source.software},
                      {"commit", source.commit},
                      {"nlopt", source.nlopt},
                      {"command", source.command},
                      {"seed", result.seed},
                      {"evaluations", result.evaluations},
                      {"targets", result.targets},
                      {"cost_before", rounded(result.cost_before)},
                      {"cost_after", rounded(result.cost_after)},
                      {"counts_scale", rounded(result.scale)},
                      {"parameters", ordered_json::array()},
                      {"statistics", ordered_json::array()},
                      {"held_out", held_out_json(result)},
                      {"blind_directions", result.blind_directions},
                      {"remarks", result.remarks}};
  for (const CalibratedParameter& p : result.parameters)
    out["parameters"].push_back(parameter_json(p));
  for (const ComparedStatistic& s : result.statistics)
    out["statistics"].push_back(statistic_json(s));
  return out;
}

Result<ordered_json> calibrated_table(std::string_view text, const CalibrationResult& result,
                                      const CalibrationSource& source) {
  ordered_json table = ordered_json::parse(text, nullptr, false);
  if (!table.is_object() || !table.contains("fabrics"))
    return fail({.code = Errc::parse,
                 .where = "fabrics",
                 .what = "not a fabric table",
                 .expected = "weft-fabrics-1 or weft-fabrics-2"});
  const std::string key = next_calibration(table);
  table["format"] = std::string(table_format);
  table["calibrations"][key] = calibration_json(result, source);
  set_common(table, result, key);
  for (const BaseCloth& cloth : result.cloths)
    add_cloth(table, result, cloth, name_in_table(source.prefix, cloth.label), key);
  return table;
}

}  // namespace weft::daemon::calibration
