#include <nlohmann/json.hpp>

#include "daemon/analysis/tradeoff/sim/sim_page.hpp"

namespace weft::daemon {

namespace {

using nlohmann::ordered_json;

constexpr int report_schema_version = 1;

ordered_json deviation_json(const SimDeviation& d) {
  return {{"max", d.max}, {"rms", d.rms}};
}

ordered_json optional_json(const std::optional<SimDeviation>& d) {
  return d ? deviation_json(*d) : ordered_json();
}

ordered_json errors_json(const SimErrors& e) {
  return {{"force_n", deviation_json(e.worst_n)},
          {"force_median_n", deviation_json(e.median_n)},
          {"normal_n", deviation_json(e.normal_n)},
          {"pads_lsb", optional_json(e.pads_lsb)},
          {"touch_s", e.touch_s ? ordered_json(*e.touch_s) : ordered_json()}};
}

ordered_json setting_json(const SimSetting& setting) {
  return {{"name", setting.name()},
          {"level", std::string(sim::to_string(setting.level))},
          {"integrator", format_integrator(setting)},
          {"step_us", setting.step_us()}};
}

ordered_json cycle_json(const SimCycle& cycle) {
  return {{"peak_to_peak_n", cycle.peak_to_peak_n}, {"frequency_hz", cycle.frequency_hz}};
}

ordered_json point_json(const SimPoint& p) {
  ordered_json out = setting_json(p.setting);
  out["total"] = errors_json(p.total);
  out["discretisation"] = p.discretisation ? errors_json(*p.discretisation) : ordered_json();
  out["model"] = p.model ? errors_json(*p.model) : ordered_json();
  out["cycle"] = cycle_json(p.cycle);
  out["failure"] = p.failure;
  out["timings_s"] = p.timings_s;
  out["best_s_per_s"] = p.best_s;
  out["median_s_per_s"] = p.median_s;
  out["setup_s"] = p.setup_s;
  out["front"] = p.front;
  return out;
}

ordered_json scene_json(const SimSceneResult& scene) {
  ordered_json out = {{"scene", scene.scene},
                      {"words", scene.words},
                      {"cases", scene.cases},
                      {"simulated_s", scene.simulated_s},
                      {"reference", scene.reference},
                      {"reference_cycle", cycle_json(scene.cycle)},
                      {"finest_l2_from_reference_n", optional_json(scene.agreement_n)},
                      {"points", ordered_json::array()},
                      {"refused", ordered_json::array()}};
  for (const SimPoint& p : scene.points) out["points"].push_back(point_json(p));
  for (const SimRefusal& refusal : scene.refusals) {
    ordered_json one = setting_json(refusal.setting);
    one["why"] = refusal.why;
    out["refused"].push_back(std::move(one));
  }
  return out;
}

/// The knob's table knows no scene without the mechanisms that a bench has.
bool is_for_bench(const SimSceneResult& scene) {
  return scene.scene != "press_plain";
}

}  // namespace

ordered_json sim_tradeoff_json(const SimTradeoffReport& report) {
  ordered_json out = {{"schema_version", report_schema_version},
                      {"bench", "simulated"},
                      {"command", report.command},
                      {"software_version", report.software},
                      {"commit", report.commit},
                      {"machine", report.machine},
                      {"load", report.load},
                      {"timing", report.timing},
                      {"sample_s", sim_sample_s},
                      {"scenes", ordered_json::array()}};
  for (const SimSceneResult& scene : report.scenes) out["scenes"].push_back(scene_json(scene));
  if (report.downstream) out["downstream"] = downstream_json(*report.downstream);
  return out;
}

ordered_json fidelity_table_json(const SimTradeoffReport& report) {
  ordered_json rows = ordered_json::array();
  for (const SimSceneResult& scene : report.scenes) {
    if (!is_for_bench(scene)) continue;
    for (const SimPoint& p : scene.points) {
      if (!p.failure.empty()) continue;
      rows.push_back({{"scene", scene.scene},
                      {"level", std::string(sim::to_string(p.setting.level))},
                      {"integrator", format_integrator(p.setting)},
                      {"step_us", p.setting.step_us()},
                      {"error_max_n", p.total.worst_n.max},
                      {"error_rms_n", p.total.worst_n.rms},
                      {"times_real_time", 1 / p.median_s}});
    }
  }
  return {{"schema_version", report_schema_version},
          {"bench", "simulated"},
          {"made_by", report.command},
          {"machine", report.machine},
          {"commit", report.commit},
          {"rows", std::move(rows)}};
}

}  // namespace weft::daemon
