#include "sim/plant/fidelity/table.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "protocols/base/json_text.hpp"
#include "sim/plant/bounds.hpp"
#include "sim/plant/field_reader.hpp"

namespace weft::sim {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::size_t most_rows = 10'000;
constexpr double largest_number = 1e12;  // upper limit of any number in the table

struct RangeField {
  const char* key;
  MeasuredRange TableConditions::*range;
};
constexpr RangeField range_fields[]{{"force_n", &TableConditions::force_n},
                                    {"speed_mps", &TableConditions::speed_mps},
                                    {"seat_speed_mps", &TableConditions::seat_speed_mps},
                                    {"press_s", &TableConditions::press_s},
                                    {"mount_stiffness_n_m", &TableConditions::mount_stiffness_n_m},
                                    {"slack_m", &TableConditions::slack_m}};

struct CostField {
  const char* key;
  double HostCost::*cost;
};
constexpr CostField cost_fields[]{{"pads_us_per_s", &HostCost::pads_us_per_s},
                                  {"emulators_us_per_s", &HostCost::emulators_us_per_s},
                                  {"drivers_us_per_s", &HostCost::drivers_us_per_s},
                                  {"recorder_us_per_s", &HostCost::recorder_us_per_s},
                                  {"export_us_per_trial", &HostCost::export_us_per_trial},
                                  {"evaluate_us_per_trial", &HostCost::evaluate_us_per_trial},
                                  {"quick_check_us_per_s", &HostCost::quick_check_us_per_s},
                                  {"full_check_us_per_s", &HostCost::full_check_us_per_s},
                                  {"probe_us", &HostCost::probe_us}};

Result<const json*> list_at(const json* list, const std::string& where) {
  if (list != nullptr && list->is_array() && list->size() <= most_rows) return list;
  return parse_error(where,
                     {.what = "list missing or too long", .expected = "at most 10000 entries"});
}

Status require_object(const json* object, const std::string& where) {
  if (object != nullptr && object->is_object()) return {};
  return parse_error(where, {.what = "object missing", .expected = "an object"});
}

Result<ClothError> read_cloth(const json& object, const std::string& where) {
  if (Status s = require_object(&object, where); !s) return pass(s.error());
  ClothError out;
  FieldReader reader(object, where);
  reader.text("fabric", out.fabric).whole("runs", out.runs, 1, largest_number);
  reader.required("q50_n", out.q50_n, 0, largest_number)
      .required("q99_n", out.q99_n, 0, largest_number);
  reader.required("max_n", out.max_n, 0, largest_number);
  if (Status s = reader.finish(); !s) return pass(s.error());
  return out;
}

Result<FidelitySetting> make_setting(const std::string& level, const std::string& integrator,
                                     double step_us, const std::string& where) {
  const auto known = level_from(level);
  if (!known || !moves(*known))
    return parse_error(where + "/level",
                       {.what = "fidelity level unknown", .expected = "L0 to L3", .got = level});
  FidelitySetting out{.level = *known, .step_s = step_us * 1e-6};
  if (*known < Level::dynamic) return out;
  const auto method = integrator_from(integrator);
  if (!method) return pass(method.error(), where + "/integrator");
  out.integrator = *method;
  return out;
}

FieldReader& read_margin(FieldReader& reader, Margin& out) {
  return reader.required("margin", out.factor, 1, 1e3).required("held_share", out.held_share, 0, 1);
}

Status read_any(const json* any, const std::string& where, MeasuredSetting& out) {
  if (Status s = require_object(any, where); !s) return s;
  FieldReader reader(*any, where);
  reader.required("q99", out.any_q99, 0, largest_number)
      .required("max", out.any_max, 0, largest_number);
  return read_margin(reader, out.any_margin).finish();
}

/// Refuses a margin that was not verified on enough held-out runs.
Status require_held(const Margin& margin, double share, const std::string& where) {
  if (margin.held_share >= share) return {};
  return fail({.code = Errc::unsupported,
               .where = where + "/held_share",
               .what = "margin holds for too few of the held-out runs",
               .expected = printed("at least %g", share),
               .got = printed("%g", margin.held_share),
               .hint = "Make a new table with weft trade sim --table FILE"});
}

Result<MeasuredSetting> read_setting(const json& object, double share, const std::string& where) {
  if (Status s = require_object(&object, where); !s) return pass(s.error());
  MeasuredSetting out;
  std::string level, integrator = "none";
  double step_us = 0;
  FieldReader reader(object, where);
  reader.text("level", level).text("integrator", integrator);
  reader.required("step_us", step_us, 0, 1e6);
  reader.required("contact_us_per_s", out.contact_us_per_s, 1e-9, largest_number);
  read_margin(reader, out.margin);
  const auto cloths = list_at(reader.child("cloths"), where + "/cloths");
  const json* any = reader.child("any");
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (!cloths) return pass(cloths.error());
  const auto setting = make_setting(level, integrator, step_us, where);
  if (!setting) return pass(setting.error());
  out.setting = *setting;
  for (std::size_t i = 0; i < (*cloths)->size(); ++i) {
    auto cloth = read_cloth((**cloths)[i], where + "/cloths/" + std::to_string(i));
    if (!cloth) return pass(cloth.error());
    out.cloths.push_back(std::move(*cloth));
  }
  if (Status s = read_any(any, where + "/any", out); !s) return pass(s.error());
  for (const auto& [margin, place] :
       {std::pair{out.margin, where}, {out.any_margin, where + "/any"}})
    if (Status s = require_held(margin, share, place); !s) return pass(s.error());
  return out;
}

Status read_conditions(const json* object, TableConditions& out) {
  const std::string where = "/conditions";
  if (Status s = require_object(object, where); !s) return s;
  FieldReader reader(*object, where);
  reader.whole("scenes", out.scenes, 1, largest_number)
      .whole("seeds", out.seeds, 1, largest_number)
      .whole("trials", out.trials, 1, largest_number);
  reader.whole("space_seed", out.space_seed, 0, largest_number).text("reference", out.reference);
  reader.required("share", out.share, 0, 1);
  const json* ranges = reader.child("ranges");
  if (Status s = reader.finish(); !s) return s;
  if (Status s = require_object(ranges, where + "/ranges"); !s) return s;
  FieldReader range_reader(*ranges, where + "/ranges");
  for (const auto& [key, range] : range_fields)
    range_reader.interval(key, (out.*range).least, (out.*range).most, 0, largest_number);
  return range_reader.finish();
}

Status read_costs(const json* object, HostCost& out) {
  if (Status s = require_object(object, "/host_cost"); !s) return s;
  FieldReader reader(*object, "/host_cost");
  for (const auto& [key, cost] : cost_fields) reader.required(key, out.*cost, 0, largest_number);
  return reader.finish();
}

/// Checked first, so that an old table is reported as old and not as invalid.
Status check_version(const json& root) {
  const auto found = root.find("schema_version");
  if (found == root.end() || !found->is_number_integer())
    return parse_error("/schema_version", {.what = "schema version missing or not a whole number"});
  if (*found == fidelity_table_version) return {};
  return fail({.code = Errc::unsupported,
               .where = "/schema_version",
               .what = "table version not supported",
               .expected = std::to_string(fidelity_table_version),
               .got = found->dump(),
               .hint = "Make a new table with weft trade sim --table FILE"});
}

Result<FidelityTable> read_table(const json& root) {
  if (Status s = check_version(root); !s) return pass(s.error());
  FidelityTable table;
  std::string bench;
  FieldReader reader(root, "");
  reader.ignore("schema_version").text("bench", bench).text("made_by", table.made_by);
  reader.text("commit", table.commit).text("machine", table.machine);
  reader.text("compiler", table.compiler).text("fabrics_sha256", table.fabrics_sha256);
  reader.whole("rules", table.rules, 0, 1e6);
  const json *conditions = reader.child("conditions"), *costs = reader.child("host_cost");
  const auto settings = list_at(reader.child("settings"), "/settings");
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (bench != "simulated")
    return parse_error(
        "/bench",
        {.what = "table is not from a simulated bench", .expected = "simulated", .got = bench});
  if (Status s = read_conditions(conditions, table.conditions); !s) return pass(s.error());
  if (Status s = read_costs(costs, table.host_cost); !s) return pass(s.error());
  if (!settings) return pass(settings.error());
  for (std::size_t i = 0; i < (*settings)->size(); ++i) {
    auto setting =
        read_setting((**settings)[i], table.conditions.share, "/settings/" + std::to_string(i));
    if (!setting) return pass(setting.error());
    table.settings.push_back(std::move(*setting));
  }
  return table;
}

ordered_json setting_json(const MeasuredSetting& measured) {
  const FidelitySetting& setting = measured.setting;
  ordered_json out{{"level", std::string(to_string(setting.level))}};
  if (setting.level >= Level::dynamic)
    out["integrator"] = std::string(to_string(setting.integrator));
  out["step_us"] = std::round(setting.step_s * 1e9) * 1e-3;  // rounded to a nanosecond
  out["contact_us_per_s"] = measured.contact_us_per_s;
  out["margin"] = measured.margin.factor;
  out["held_share"] = measured.margin.held_share;
  out["cloths"] = ordered_json::array();
  for (const ClothError& cloth : measured.cloths)
    out["cloths"].push_back({{"fabric", cloth.fabric},
                             {"runs", cloth.runs},
                             {"q50_n", cloth.q50_n},
                             {"q99_n", cloth.q99_n},
                             {"max_n", cloth.max_n}});
  out["any"] = {{"q99", measured.any_q99},
                {"max", measured.any_max},
                {"margin", measured.any_margin.factor},
                {"held_share", measured.any_margin.held_share}};
  return out;
}

ordered_json conditions_json(const TableConditions& conditions) {
  ordered_json out{{"scenes", conditions.scenes},       {"seeds", conditions.seeds},
                   {"trials", conditions.trials},       {"space_seed", conditions.space_seed},
                   {"reference", conditions.reference}, {"share", conditions.share}};
  for (const auto& [key, range] : range_fields)
    out["ranges"][key] = {(conditions.*range).least, (conditions.*range).most};
  return out;
}

}  // namespace

Result<FidelityTable> parse_fidelity(std::string_view text) {
  const Result<json> root = parse_json(text);
  if (!root) return pass(root.error(), "fidelity table");
  if (!root->is_object())
    return parse_error("fidelity table",
                       {.what = "value has the wrong type", .expected = "an object"});
  return read_table(*root);
}

std::string to_json(const FidelityTable& table) {
  ordered_json out{{"schema_version", fidelity_table_version},
                   {"bench", "simulated"},
                   {"made_by", table.made_by},
                   {"commit", table.commit},
                   {"machine", table.machine},
                   {"compiler", table.compiler},
                   {"rules", table.rules},
                   {"fabrics_sha256", table.fabrics_sha256},
                   {"conditions", conditions_json(table.conditions)},
                   {"settings", ordered_json::array()}};
  for (const MeasuredSetting& setting : table.settings)
    out["settings"].push_back(setting_json(setting));
  for (const auto& [key, cost] : cost_fields) out["host_cost"][key] = table.host_cost.*cost;
  return out.dump(1) + "\n";
}

}  // namespace weft::sim
