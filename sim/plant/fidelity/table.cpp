#include "sim/plant/fidelity/table.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "protocols/base/names.hpp"
#include "sim/plant/field_reader.hpp"

namespace weft::sim {
namespace {

using nlohmann::json;

constexpr std::size_t most_rows = 10'000;
constexpr std::array<std::string_view, 5> scenes{"press", "slide", "stick_slip", "retouch",
                                                 "fabrics17"};

Result<FidelityRow> read_row(const json& object, const std::string& where) {
  if (!object.is_object())
    return fail(
        {.code = Errc::parse, .where = where, .what = "not a row", .expected = "an object"});
  FidelityRow row;
  std::string level, integrator = "none";
  double step_us = 0;
  FieldReader reader(object, where);
  reader.text("scene", row.scene).text("level", level).text("integrator", integrator);
  reader.required("step_us", step_us, 0, 1e6);
  reader.required("error_max_n", row.error_max_n, 0, 1e9);
  reader.required("error_rms_n", row.error_rms_n, 0, 1e9);
  reader.required("times_real_time", row.times_real_time, 1e-9, 1e12);
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (std::find(scenes.begin(), scenes.end(), row.scene) == scenes.end())
    return fail({.code = Errc::parse,
                 .where = where + "/scene",
                 .what = "no such scene",
                 .expected = "press, slide, stick_slip, retouch or fabrics17",
                 .got = row.scene});
  const auto known = level_from(level);
  if (!known || !moves(*known))
    return fail({.code = Errc::parse,
                 .where = where + "/level",
                 .what = "no such level of motion",
                 .expected = "L0 to L3",
                 .got = level});
  row.setting = {.level = *known, .step_s = step_us * 1e-6};
  if (*known < Level::dynamic) return row;
  const auto method = integrator_from(integrator);
  if (!method) return pass(method.error(), where + "/integrator");
  row.setting.integrator = *method;
  return row;
}

Result<FidelityTable> read_table(const json& root) {
  FidelityTable table;
  double version = 0;
  std::string bench;
  FieldReader reader(root, "");
  reader.required("schema_version", version, 1, 1).text("bench", bench);
  reader.text("made_by", table.made_by).text("machine", table.machine);
  reader.text("commit", table.commit);
  const json* rows = reader.child("rows");
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (bench != "simulated")
    return fail({.code = Errc::parse,
                 .where = "/bench",
                 .what = "not a table of simulations",
                 .expected = "simulated",
                 .got = bench});
  if (rows == nullptr || !rows->is_array() || rows->size() > most_rows)
    return fail({.code = Errc::parse,
                 .where = "/rows",
                 .what = "not a list of rows",
                 .expected = "at most 10000 rows"});
  for (std::size_t i = 0; i < rows->size(); ++i) {
    auto row = read_row((*rows)[i], "/rows/" + std::to_string(i));
    if (!row) return pass(row.error());
    table.rows.push_back(std::move(*row));
  }
  return table;
}

constexpr double reference_l2_step_s = 0.2e-3;  // docs/reference/plant.md, Levels
constexpr double finer_share = 0.25;
constexpr NameTable<Integrator, 3> integrator_names = {{
    {Integrator::midpoint, "midpoint"},
    {Integrator::tr_bdf2, "tr_bdf2"},
    {Integrator::adaptive, "adaptive"},
}};

std::string milliseconds(double seconds) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g ms", seconds * 1e3);
  return text.data();
}

}  // namespace

Result<FidelityTable> parse_fidelity(std::string_view text) {
  const json root = json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!root.is_object())
    return fail({.code = Errc::parse,
                 .where = "fidelity table",
                 .what = "not a JSON object",
                 .expected = "an object"});
  return read_table(root);
}

std::string_view to_string(Integrator integrator) {
  return name_in(integrator_names, integrator);
}

Result<Integrator> integrator_from(std::string_view name) {
  return value_from(integrator_names, name, "no such integrator", "midpoint, tr_bdf2 or adaptive");
}

std::string to_string(const FidelitySetting& setting) {
  std::string text{to_string(setting.level)};
  if (setting.level < Level::quasistatic) return text;
  if (setting.level >= Level::dynamic) text += " " + std::string(to_string(setting.integrator));
  return text + " " + milliseconds(setting.step_s > 0 ? setting.step_s : grid_step_s);
}

FidelitySetting setting_of(const PlantParams& params) {
  if (params.level < Level::quasistatic) return {.level = params.level};
  if (params.level == Level::quasistatic)
    return {.level = params.level, .step_s = params.quasistatic_step_s};
  return {.level = params.level,
          .integrator = params.dynamics.integrator,
          .step_s = std::min(params.dynamics.step_s, grid_step_s)};
}

void apply(const FidelitySetting& setting, PlantParams& params) {
  params.level = setting.level;
  const double step_s = setting.step_s > 0 ? setting.step_s : grid_step_s;
  params.quasistatic_step_s = step_s;
  params.dynamics.step_s = step_s;
  params.dynamics.integrator = setting.integrator;
}

std::vector<FidelitySetting> finer_than(const FidelitySetting& setting) {
  const double step_s = setting.step_s > 0 ? setting.step_s : grid_step_s;
  FidelitySetting quarter = setting;
  quarter.step_s = finer_share * step_s;
  const FidelitySetting dynamic{Level::dynamic, Integrator::midpoint, reference_l2_step_s};
  if (setting.level < Level::quasistatic)
    return {{.level = Level::quasistatic, .step_s = grid_step_s}};
  if (setting.level == Level::quasistatic) return {quarter, dynamic};
  return {quarter};
}

}  // namespace weft::sim
