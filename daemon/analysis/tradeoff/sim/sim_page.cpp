#include "daemon/analysis/tradeoff/sim/sim_page.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"
#include "daemon/pages/plot/scatter.hpp"

namespace weft::daemon {
namespace {

constexpr double fine_resolution_n = 10e-3;    // ATI Mini40 SI-40-2, Fx and Fy [E]
constexpr double coarse_resolution_n = 20e-3;  // Fz
constexpr std::string_view page_stamp = "SIMULATED";
constexpr std::string_view x_title = "processor seconds per simulated second";

/// "12 mN", "3.4 \u00B5N".
std::string force_text(double n) {
  if (n >= 0.1) return general(n) + " N";
  if (n >= 1e-4) return general(n * 1e3) + " mN";
  return general(n * 1e6) + " \u00B5N";
}

std::string rounded(double value) {
  if (!(value > 0)) return "0";
  const int digits = value >= 100 ? 0 : value >= 10 ? 1 : 2;
  return fixed(value, digits);
}

/// Three digits at most, with the unit that suits.
std::string force_cell(const SimDeviation& d) {
  const auto text = [](double n) {
    if (n >= 1) return rounded(n) + " N";
    if (n >= 1e-3) return rounded(n * 1e3) + " mN";
    return rounded(n * 1e6) + " \u00B5N";
  };
  return text(d.max) + "<span class=\"interval-text\">" + text(d.rms) + " rms</span>";
}

std::string pads_cell(const SimErrors& e) {
  if (!e.pads_lsb) return std::string(no_value);
  return fixed(e.pads_lsb->max, 0) + "<span class=\"interval-text\">" + fixed(e.pads_lsb->rms, 3) +
         " rms</span>";
}

std::string touch_cell(const SimErrors& e) {
  return e.touch_s ? rounded(*e.touch_s * 1e6) + " \u00B5s" : std::string(no_value);
}

std::string cycle_cell(const SimCycle& cycle) {
  return fixed(cycle.peak_to_peak_n, 4) + " N<span class=\"interval-text\">" +
         fixed(cycle.frequency_hz, 2) + " Hz</span>";
}

std::string step_label(const SimSetting& setting) {
  const double us = setting.step_us();
  if (us <= 0) return "L0";
  return us >= 1000 ? general(us / 1000) + " ms" : general(us) + " \u00B5s";
}

std::vector<std::string> list_families(const std::vector<SimSceneResult>& scenes) {
  std::vector<std::string> out;
  for (const SimSceneResult& scene : scenes)
    for (const SimPoint& p : scene.points)
      if (std::ranges::find(out, p.setting.family()) == out.end())
        out.push_back(p.setting.family());
  return out;
}

/// What a panel shows of a point; nothing leaves the point out.
using Shown = std::optional<SimDeviation> (*)(const SimPoint&);

/// Marks the front of its own figures: another kind of error has another front.
void mark_front(std::vector<ScatterPoint>& points) {
  std::vector<TradeoffChoice> bargains;
  for (const ScatterPoint& p : points) bargains.push_back({-p.share, p.time_s});
  const auto front = pareto_front(bargains);
  if (!front) return;
  for (const std::size_t i : *front) points[i].front = true;
}

ScatterPanel panel_of(const SimSceneResult& scene, const std::vector<std::string>& families,
                      std::string title, Shown shown, double SimDeviation::*value,
                      bool with_front = true) {
  ScatterPanel out{std::move(title), std::string(x_title), {}, {}};
  for (const SimPoint& p : scene.points) {
    const auto error = shown(p);
    if (!p.failure.empty() || !error || !((*error).*value > 0)) continue;
    const auto family = std::ranges::find(families, p.setting.family()) - families.begin();
    out.points.push_back({p.best_s, (*error).*value, 0, 0, static_cast<std::size_t>(family), false,
                          step_label(p.setting)});
  }
  if (with_front) mark_front(out.points);
  return out;
}

std::optional<SimDeviation> total_of(const SimPoint& p) {
  return p.total.worst_n;
}
std::optional<SimDeviation> discretisation_of(const SimPoint& p) {
  return p.discretisation ? std::optional(p.discretisation->worst_n) : std::nullopt;
}
std::optional<SimDeviation> pads_of(const SimPoint& p) {
  return p.total.pads_lsb;
}

std::string scrolled(const Scatter& scatter) {
  return "<div class=\"scroll\">" + scatter_figure(scatter) + "</div>\n";
}

std::string force_picture(const SimSceneResult& scene, const std::vector<std::string>& families) {
  Scatter out{"Work-precision diagram, " + std::string(page_stamp) + ", scene " + scene.scene,
              "largest force error [N]",
              std::string(page_stamp),
              families,
              {panel_of(scene, families, "(a) against the reference: model and step", total_of,
                        &SimDeviation::max),
               panel_of(scene, families, "(b) against the same level's finest run: step alone",
                        discretisation_of, &SimDeviation::max, false)},
              true};
  for (ScatterPanel& panel : out.panels)
    panel.lines = {{fine_resolution_n, "Mini40 Fx, Fy: 10 mN", true},
                   {coarse_resolution_n, "Mini40 Fz: 20 mN"}};
  return scrolled(out);
}

std::string pads_picture(const SimSceneResult& scene, const std::vector<std::string>& families) {
  Scatter out{
      "Pads' error against time, " + std::string(page_stamp) + ", scene " + scene.scene,
      "error of the pads [LSB]",
      std::string(page_stamp),
      families,
      {panel_of(scene, families, "(c) root mean square of all pads", pads_of, &SimDeviation::rms),
       panel_of(scene, families, "(d) largest error of any pad", pads_of, &SimDeviation::max)},
      true};
  for (ScatterPanel& panel : out.panels) panel.lines = {{1, "1 LSB"}};
  return out.panels.front().points.empty() ? "" : scrolled(out);
}

std::string errors_cell(const std::optional<SimErrors>& errors) {
  return errors ? force_cell(errors->worst_n) : std::string(no_value);
}

std::string table(const SimSceneResult& scene) {
  const bool cycles = scene.cycle.frequency_hz > 0, many = scene.cases > 1;
  std::vector<std::string> head{"setting",      "force error", "normal part", "of the step",
                                "of the model", "pads [LSB]",  "touch-down"};
  if (many) head.insert(head.begin() + 2, "median cloth");
  if (cycles) head.emplace_back("cycle");
  for (const char* name : {"times real time", "median", "set up"}) head.emplace_back(name);
  HtmlTable out(head, 1);
  for (const SimPoint& p : scene.points) {
    std::vector<std::string> row{escape(p.setting.name()) + (p.front             ? " \u25C6"
                                                             : p.failure.empty() ? ""
                                                                                 : " \u2717"),
                                 force_cell(p.total.worst_n),
                                 force_cell(p.total.normal_n),
                                 errors_cell(p.discretisation),
                                 errors_cell(p.model),
                                 pads_cell(p.total),
                                 touch_cell(p.total)};
    if (many) row.insert(row.begin() + 2, force_cell(p.total.median_n));
    if (cycles) row.push_back(cycle_cell(p.cycle));
    row.push_back(thousands(static_cast<std::size_t>(1 / p.best_s)));
    row.push_back(thousands(static_cast<std::size_t>(1 / p.median_s)));
    row.push_back(duration(p.setup_s));
    out.row(row, p.front ? "on-front" : "");
  }
  return out.finish();
}

std::string facts(const SimSceneResult& scene) {
  std::string out = "<figure><dl>\n" + definition("what happens", scene.words) +
                    definition("runs", std::to_string(scene.cases) + ", together " +
                                           fixed(scene.simulated_s, 1) + " simulated seconds") +
                    definition("reference", scene.reference);
  if (scene.agreement_n)
    out += definition("finest L2 against it", force_text(scene.agreement_n->max) + " largest, " +
                                                  force_text(scene.agreement_n->rms) + " rms");
  if (scene.cycle.frequency_hz > 0)
    out += definition("its stick-slip cycle", fixed(scene.cycle.peak_to_peak_n, 4) + " N at " +
                                                  fixed(scene.cycle.frequency_hz, 2) + " Hz");
  return out + "</dl></figure>\n";
}

std::string section(const SimSceneResult& scene, const std::vector<std::string>& families) {
  std::string out =
      "<section>\n<h2>" + escape(scene.scene) + " " + simulated_badge() + "</h2>\n" + facts(scene);
  out += figure(force_picture(scene, families),
                "Every mark is one level, integrator and step; the front of (a) is the best "
                "that a time buys; (b) shows how each level converges on itself. Below the dotted "
                "lines the sensor cannot tell the runs apart. Failed runs "
                "are not drawn but listed below.",
                simulated_badge());
  if (const std::string pads = pads_picture(scene, families); !pads.empty())
    out += figure(pads,
                  "All 16 pads at every sample, without their noise. An error of nothing at all "
                  "has no place on this axis.",
                  simulated_badge());
  return out +
         figure(table(scene),
                "Largest error and root mean square over the samples, of the worst run. \u25C6 on "
                "the front of (a), \u2717 failed. Of the step: against the finest run of the same "
                "level; from L2 on that is the reference. Of the model: L0 against L1, L1's finest "
                "run against the reference, L2's reference against what rubbing adds at L3.",
                simulated_badge()) +
         "</section>\n";
}

std::string failures(const std::vector<SimSceneResult>& scenes) {
  HtmlTable out({"scene", "setting", "what went wrong"}, 3);
  bool any = false;
  for (const SimSceneResult& scene : scenes) {
    for (const SimPoint& p : scene.points) {
      if (p.failure.empty()) continue;
      out.row({escape(scene.scene), escape(p.setting.name()), escape(p.failure)});
      any = true;
    }
    for (const SimRefusal& r : scene.refusals) {
      out.row({escape(scene.scene), escape(r.setting.name()), "refused: " + escape(r.why)});
      any = true;
    }
  }
  return "<section>\n<h2>Failures " + simulated_badge() + "</h2>\n" +
         (any ? figure(out.finish(),
                       "Settings that ran but lost what the scene is about, or did not run.",
                       simulated_badge())
              : "<p>None.</p>\n") +
         "</section>\n";
}

std::string heading() {
  return "<header>" + simulated_badge() +
         "\n<h1>Plant: accuracy against time</h1>\n"
         "<p>Every level of the plant, integrator and step on the same scenes. Everything here is "
         "computed; no cloth was touched. An error tells how far a run is from the equations of "
         "level L2, not from a real cloth.</p>\n"
         "<p>The force is the vector that a force sensor under the plate sees, at its 37 Hz "
         "samples. Times are of the contact alone: pads, devices and the recorder cost the same "
         "at every level and come on top.</p>\n</header>\n";
}

std::string provenance(const SimTradeoffReport& report) {
  return "<section>\n<h2>How it was measured</h2>\n<figure><dl>\n" +
         definition("command", report.command) + definition("timing", report.timing) +
         definition("machine", report.machine) + definition("load", report.load) +
         definition("software", "weft " + report.software +
                                    (report.commit.empty() ? "" : ", commit " + report.commit)) +
         "</dl></figure>\n</section>\n";
}

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

}  // namespace

std::string sim_tradeoff_html(const SimTradeoffReport& report) {
  const std::vector<std::string> families = list_families(report.scenes);
  std::string out = heading();
  for (const SimSceneResult& scene : report.scenes) out += section(scene, families);
  if (!report.scenes.empty()) out += failures(report.scenes);
  if (report.downstream) out += downstream_html(*report.downstream);
  return page_around("Plant: accuracy against time", out + provenance(report));
}

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

}  // namespace weft::daemon
