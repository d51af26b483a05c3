#include "sim/plant/fidelity/table.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

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

}  // namespace weft::sim
