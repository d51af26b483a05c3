#include "daemon/analysis/tradeoff/sim/reference_file.hpp"

#include <nlohmann/json.hpp>

namespace weft::daemon {

namespace {

using nlohmann::ordered_json;
using sim::ContactState;

constexpr int reference_schema_version = 1;

struct Column {
  const char* name;
  double (*get)(const ContactState&);
  void (*set)(ContactState&, double);
};

constexpr Column columns[] = {
    {"y_m", [](const ContactState& s) { return s.pose.y_m; },
     [](ContactState& s, double x) { s.pose.y_m = x; }},
    {"z_m", [](const ContactState& s) { return s.pose.z_m; },
     [](ContactState& s, double x) { s.pose.z_m = x; }},
    {"extension_m", [](const ContactState& s) { return s.extension_m; },
     [](ContactState& s, double x) { s.extension_m = x; }},
    {"indentation_m", [](const ContactState& s) { return s.indentation_m; },
     [](ContactState& s, double x) { s.indentation_m = x; }},
    {"lag_y_m", [](const ContactState& s) { return s.lag_m[1]; },
     [](ContactState& s, double x) { s.lag_m[1] = x; }},
    {"slope_x", [](const ContactState& s) { return s.slope_x; },
     [](ContactState& s, double x) { s.slope_x = x; }},
    {"slope_y", [](const ContactState& s) { return s.slope_y; },
     [](ContactState& s, double x) { s.slope_y = x; }},
    {"load_ratio", [](const ContactState& s) { return s.load_ratio; },
     [](ContactState& s, double x) { s.load_ratio = x; }},
    {"normal_n", [](const ContactState& s) { return s.normal_n; },
     [](ContactState& s, double x) { s.normal_n = x; }},
    {"friction_y_n", [](const ContactState& s) { return s.friction_n[1]; },
     [](ContactState& s, double x) { s.friction_n[1] = x; }}};

ordered_json case_json(const SimCase& one, const SimTrace& trace) {
  ordered_json samples = ordered_json::array();
  for (const ContactState& state : trace.samples) {
    ordered_json row = ordered_json::array();
    for (const Column& column : columns) row.push_back(column.get(state));
    samples.push_back(std::move(row));
  }
  return {{"name", one.name},
          {"touch_s", trace.touch_s},
          {"cycle_n", trace.cycle.peak_to_peak_n},
          {"cycle_hz", trace.cycle.frequency_hz},
          {"samples", std::move(samples)}};
}

SimTrace trace_from(const ordered_json& json) {
  SimTrace out;
  out.touch_s = json.at("touch_s").get<std::vector<double>>();
  out.cycle = {json.at("cycle_n").get<double>(), json.at("cycle_hz").get<double>()};
  for (const ordered_json& row : json.at("samples")) {
    ContactState state;
    for (std::size_t i = 0; i < std::size(columns); ++i)
      columns[i].set(state, row.at(i).get<double>());
    out.samples.push_back(state);
  }
  return out;
}

Result<SimReference> reference_from(const ordered_json& json, const SimScene& scene,
                                    const std::string& made_by) {
  const auto refuse = [&](std::string expected, std::string got) {
    return fail({.code = Errc::invalid_argument,
                 .where = scene.name,
                 .what = "the reference is of another scene",
                 .expected = std::move(expected),
                 .got = std::move(got),
                 .hint = "Make it again with bench_sim_reference and the same cloth table"});
  };
  const std::string fingerprint = json.at("fingerprint").get<std::string>();
  if (fingerprint != sim_fingerprint(scene))
    return refuse("fingerprint " + sim_fingerprint(scene), fingerprint);
  SimReference out{made_by, {}};
  for (const ordered_json& one : json.at("cases")) out.traces.push_back(trace_from(one));
  if (out.traces.size() != scene.cases.size())
    return refuse(std::to_string(scene.cases.size()) + " cases", std::to_string(out.traces.size()));
  for (std::size_t i = 0; i < scene.cases.size(); ++i)
    if (out.traces[i].samples.size() != scene.cases[i].samples)
      return refuse(std::to_string(scene.cases[i].samples) + " samples",
                    std::to_string(out.traces[i].samples.size()));
  return out;
}

}  // namespace

std::string write_references(const std::string& made_by, std::span<const ReferenceScene> scenes) {
  ordered_json names = ordered_json::array(), list = ordered_json::array();
  for (const Column& column : columns) names.push_back(column.name);
  for (const ReferenceScene& one : scenes) {
    ordered_json cases = ordered_json::array();
    for (std::size_t i = 0; i < one.traces.size(); ++i)
      cases.push_back(case_json(one.scene.cases[i], one.traces[i]));
    list.push_back({{"scene", one.scene.name},
                    {"fingerprint", sim_fingerprint(one.scene)},
                    {"cases", std::move(cases)}});
  }
  const ordered_json out = {{"schema_version", reference_schema_version},
                            {"bench", "simulated"},
                            {"made_by", made_by},
                            {"sample_s", sim_sample_s},
                            {"columns", std::move(names)},
                            {"scenes", std::move(list)}};
  return out.dump() + "\n";
}

Result<std::map<std::string, SimReference>> read_references(std::string_view json,
                                                            std::span<const SimScene> scenes) {
  std::map<std::string, SimReference> out;
  try {
    const ordered_json file = ordered_json::parse(json);
    if (file.at("schema_version").get<int>() != reference_schema_version)
      return fail({.code = Errc::parse,
                   .where = "schema_version",
                   .what = "a reference of another version",
                   .expected = std::to_string(reference_schema_version),
                   .got = file.at("schema_version").dump()});
    const std::string made_by = file.at("made_by").get<std::string>();
    for (const ordered_json& one : file.at("scenes"))
      for (const SimScene& scene : scenes) {
        if (scene.name != one.at("scene").get<std::string>()) continue;
        auto reference = reference_from(one, scene, made_by);
        if (!reference) return pass(reference.error());
        out.emplace(scene.name, std::move(*reference));
      }
  } catch (const nlohmann::json::exception& e) {
    return fail(
        {.code = Errc::parse, .where = e.what(), .what = "not a file of reference trajectories"});
  }
  return out;
}

}  // namespace weft::daemon
