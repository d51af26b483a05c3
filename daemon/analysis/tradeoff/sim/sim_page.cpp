#include "daemon/analysis/tradeoff/sim/sim_page.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/document.hpp"

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

/// At most three digits, with a suitable unit.
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

/// The value of a point in a panel; nothing leaves the point out.
using Shown = std::optional<SimDeviation> (*)(const SimPoint&);

/// Marks the front of these points: another kind of error has another front.
void mark_front(std::vector<chart::FamilySample>& points) {
  std::vector<TradeoffChoice> bargains;
  for (const auto& p : points) bargains.push_back({-p.sample.y, p.sample.x});
  const auto front = pareto_front(bargains);
  if (!front) return;
  for (const std::size_t i : *front) points[i].sample.front = true;
  for (auto& p : points)
    if (!p.sample.front) p.sample.label.clear();
}

chart::Panel panel_of(const SimSceneResult& scene, const std::vector<std::string>& families,
                      std::string title, Shown shown, double SimDeviation::*value,
                      bool with_front = true) {
  std::vector<chart::FamilySample> points;
  for (const SimPoint& p : scene.points) {
    const auto error = shown(p);
    if (!p.failure.empty() || !error || !((*error).*value > 0)) continue;
    const auto family = std::ranges::find(families, p.setting.family()) - families.begin();
    chart::Sample sample{p.best_s, (*error).*value};
    if (with_front) sample.label = step_label(p.setting);
    points.push_back({static_cast<std::size_t>(family), std::move(sample)});
  }
  if (with_front) mark_front(points);
  chart::Panel out{std::move(title), {.title = std::string(x_title), .logarithmic = true}};
  out.y.logarithmic = true;
  out.series = chart::series_of(families, points);
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

/// Two panels with a common error axis.
chart::Plot two_panels(std::string words, const std::string& y_title, chart::Panel first,
                       chart::Panel second, const std::vector<chart::Limit>& limits) {
  chart::Plot out{std::move(words), std::string(page_stamp), 2, 1100, 300, false, true};
  out.front_name = "Pareto front";
  out.panels = {std::move(first), std::move(second)};
  for (chart::Panel& panel : out.panels) {
    panel.y.title = y_title;
    panel.limits = limits;
  }
  return out;
}

chart::Plot force_plot(const SimSceneResult& scene, const std::vector<std::string>& families) {
  return two_panels(
      "Work-precision diagram, " + std::string(page_stamp) + ", scene " + scene.scene,
      "largest force error [N]",
      panel_of(scene, families, "(a) against the reference: model and step", total_of,
               &SimDeviation::max),
      panel_of(scene, families, "(b) against the level's finest run: step alone", discretisation_of,
               &SimDeviation::max, false),
      {{fine_resolution_n, "Mini40 Fx, Fy: 10 mN"}, {coarse_resolution_n, "Mini40 Fz: 20 mN"}});
}

/// Empty for a scene without taxel counts.
Blocks pads_picture(const SimSceneResult& scene, const std::vector<std::string>& families) {
  chart::Plot out = two_panels(
      "Taxel error against time, " + std::string(page_stamp) + ", scene " + scene.scene,
      "error of the taxels [LSB]",
      panel_of(scene, families, "(c) root mean square of all taxels", pads_of, &SimDeviation::rms),
      panel_of(scene, families, "(d) largest error of any taxel", pads_of, &SimDeviation::max),
      {{1, "1 LSB"}});
  return out.panels.front().series.empty() ? Blocks{} : picture(std::move(out));
}

std::string errors_cell(const std::optional<SimErrors>& errors) {
  return errors ? force_cell(errors->worst_n) : std::string(no_value);
}

Blocks table(const SimSceneResult& scene) {
  const bool cycles = scene.cycle.frequency_hz > 0, many = scene.cases > 1;
  std::vector<std::string> head{"setting",     "force error",  "normal part", "step error",
                                "model error", "taxels [LSB]", "touch-down"};
  if (many) head.insert(head.begin() + 2, "median fabric");
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

Blocks facts(const SimSceneResult& scene) {
  std::vector<std::pair<std::string, std::string>> out{
      {"scene", scene.words},
      {"runs", std::to_string(scene.cases) + ", in total " + fixed(scene.simulated_s, 1) +
                   " simulated seconds"},
      {"reference", scene.reference}};
  if (scene.agreement_n)
    out.emplace_back("finest L2 against the reference",
                     force_text(scene.agreement_n->max) + " largest, " +
                         force_text(scene.agreement_n->rms) + " rms");
  if (scene.cycle.frequency_hz > 0)
    out.emplace_back("stick-slip cycle of the reference",
                     fixed(scene.cycle.peak_to_peak_n, 4) + " N at " +
                         fixed(scene.cycle.frequency_hz, 2) + " Hz");
  return figure(definitions(out), "Runs and the accuracy of their reference.", simulated_badge());
}

Blocks scene_pictures(const SimSceneResult& scene, const std::vector<std::string>& families) {
  Blocks out =
      figure(picture(force_plot(scene, families)),
             "Each mark is one level, integrator and step. The Pareto front of (a) has the "
             "least error for the time; (b) shows the convergence of each level. Below the "
             "dotted lines the sensor cannot resolve the differences. Failed runs are not "
             "drawn; they are listed below.",
             simulated_badge());
  if (Blocks pads = pads_picture(scene, families); !pads.empty())
    out += figure(std::move(pads),
                  "All 16 taxels at every sample, without noise. This axis cannot show an error "
                  "of zero.",
                  simulated_badge());
  return section(scene.scene, std::move(out));
}

Blocks scene_table(const SimSceneResult& scene) {
  return section(
      "Scene " + scene.scene,
      facts(scene) +
          figure(
              table(scene),
              "Largest error and root mean square over the samples of the worst run. \u25C6 on "
              "the Pareto front of (a), \u2717 failed. Step error: against the finest run of the "
              "same level (from L2 on, the reference). Model error: L0 against L1, L1's finest "
              "run against the reference, L2's reference against the rubbing of L3.",
              simulated_badge()));
}

Blocks failures(const std::vector<SimSceneResult>& scenes) {
  HtmlTable out({"scene", "setting", "failure"}, 3);
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
  return section(
      "Failures",
      any ? figure(out.finish(), "Settings that failed, or lost the effect that the scene tests.",
                   simulated_badge())
          : paragraph("None."));
}

/// The most accurate setting on the front, for each scene.
Blocks exact_settings(const std::vector<SimSceneResult>& scenes) {
  Blocks out;
  for (const SimSceneResult& scene : scenes) {
    const SimPoint* best = nullptr;
    for (const SimPoint& p : scene.points)
      if (p.front && (best == nullptr || p.total.worst_n.max < best->total.worst_n.max)) best = &p;
    if (best != nullptr)
      out += paragraph("<b>" + escape(scene.scene) + ": " + escape(best->setting.name()) +
                       "</b>, largest force error " + force_text(best->total.worst_n.max) + " at " +
                       thousands(static_cast<std::size_t>(1 / best->best_s)) +
                       " times real time. " + simulated_badge());
  }
  return section("Least error on each Pareto front", std::move(out));
}

Blocks how_it_is_meant() {
  return paragraph(
             "Every level of the plant, integrator and step on the same scenes. All values "
             "are computed; no fabric was touched. An error is the difference of a run from "
             "the equations of level L2, not from a real fabric.") +
         paragraph(
             "The force is the vector measured by a force sensor under the plate, sampled at "
             "37 Hz. Times are those of the contact only. Taxels, devices and the recorder "
             "add the same time at every level.");
}

Blocks provenance(const SimTradeoffReport& report) {
  return definitions(
      {{"command", report.command},
       {"timing", report.timing},
       {"machine", report.machine},
       {"load", report.load},
       {"software",
        "weft " + report.software + (report.commit.empty() ? "" : ", commit " + report.commit)}});
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

}  // namespace

Document sim_document(const SimTradeoffReport& report) {
  const std::vector<std::string> families = list_families(report.scenes);
  Document out{"plant fidelity", "Plant: accuracy against time", std::string(page_stamp)};
  out.result = exact_settings(report.scenes);
  for (const SimSceneResult& scene : report.scenes) {
    out.pictures += scene_pictures(scene, families);
    out.tables += scene_table(scene);
  }
  if (!report.scenes.empty()) out.tables += failures(report.scenes);
  if (report.downstream) out.tables += downstream_section(*report.downstream);
  out.method = how_it_is_meant();
  out.provenance = provenance(report);
  return out;
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
