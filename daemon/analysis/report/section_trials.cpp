#include <algorithm>
#include <cmath>

#include "daemon/analysis/report/paper.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/analysis/report/trace.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"

namespace weft::daemon {
namespace {

using svg::Anchor;
using svg::Axes;
using svg::Canvas;
using svg::Range;

constexpr double wide = 760;

double end_of(const TrialTrace& trace) {
  const double taxels_s = trace.phases.empty() ? 1 : trace.phases.back().end_s;
  return trace.normal_n.t_s.empty() ? taxels_s : std::max(taxels_s, trace.normal_n.t_s.back());
}

std::string phase_class(Phase phase) {
  return std::string("phase phase-") + to_char(phase);
}

void shade_phases(Canvas& canvas, const Axes& axes, const std::vector<PhaseSpan>& phases) {
  for (const PhaseSpan& span : phases) {
    const double x = axes.x(span.begin_s), width = axes.x(span.end_s) - x;
    canvas.rect({x, axes.area.y, width, axes.area.height}, phase_class(span.phase));
  }
}

void name_phases(Canvas& canvas, const Axes& axes, const std::vector<PhaseSpan>& phases) {
  for (const PhaseSpan& span : phases) {
    const double x = (axes.x(span.begin_s) + axes.x(span.end_s)) / 2;
    canvas.text({x, axes.area.y - 6}, std::string(1, to_char(span.phase)), "phase-name",
                Anchor::middle);
  }
}

std::vector<svg::Point> in_axes(const Axes& axes, const Curve& curve, std::size_t buckets) {
  std::vector<svg::Point> points = thinned(curve, buckets);
  for (svg::Point& p : points) p = axes.at(p.x, p.y);
  return points;
}

void draw_target(Canvas& canvas, const Axes& axes, const TrialTrace& trace,
                 const ForceTarget& target) {
  for (const PhaseSpan& span : trace.phases) {
    if (span.phase != Phase::motion && span.phase != Phase::press) continue;
    const svg::Point corner = axes.at(span.begin_s, target.force_n + target.band_n);
    const svg::Point opposite = axes.at(span.end_s, target.force_n - target.band_n);
    canvas.rect({corner.x, corner.y, opposite.x - corner.x, opposite.y - corner.y}, "force-band");
  }
}

// A mark of the key and its words; returns where the next may start.
double key(Canvas& canvas, double x, double y, std::string_view words, std::string_view mark) {
  canvas.rect({x, y - 7, 16, mark == "force-band" ? 8.0 : 3.0}, mark);
  canvas.text({x + 21, y}, words, "key");
  return x + 36 + 6.6 * static_cast<double>(words.size());
}

std::vector<double> force_values(const TrialTrace& trace, const std::optional<ForceTarget>& t) {
  std::vector<double> values = {0};
  values.insert(values.end(), trace.normal_n.value.begin(), trace.normal_n.value.end());
  values.insert(values.end(), trace.tangential_n.value.begin(), trace.tangential_n.value.end());
  if (t) values.push_back(t->force_n + t->band_n);
  return values;
}

/// Normal and tangential force over time, phases shaded, set point and band when known.
std::string force_figure(const TrialTrace& trace, const std::optional<ForceTarget>& target) {
  Canvas canvas(wide, 330, "Force over time of one trial, phases shaded", "plot");
  const std::vector<double> values = force_values(trace, target);
  Range y = svg::find_range(values, 0.06);
  const Axes axes({58, 44, wide - 70, 236}, {0, end_of(trace)}, y);
  shade_phases(canvas, axes, trace.phases);
  axes.draw_x(canvas, "time [s]", 10);
  axes.draw_y(canvas, "force [N]", 6);
  name_phases(canvas, axes, trace.phases);
  if (target) draw_target(canvas, axes, trace, *target);
  canvas.polyline(in_axes(axes, trace.tangential_n, 500), "curve second");
  canvas.polyline(in_axes(axes, trace.normal_n, 600), "curve first");
  double x = key(canvas, 58, 16, "normal force", "key-first");
  x = key(canvas, x, 16, "tangential force", "key-second");
  if (target)
    key(canvas, x, 16,
        "set point " + fixed(target->force_n, 1) + " N, band \u00B1" + fixed(target->band_n, 2) +
            " N",
        "force-band");
  return canvas.finish();
}

/// Range of all pads together, so that the small pictures compare.
svg::Range pad_range(const TrialTrace& trace) {
  std::vector<double> values;
  for (const Curve& pad : trace.pads)
    values.insert(values.end(), pad.value.begin(), pad.value.end());
  return svg::find_range(values);
}

/// One pad's counts over time, phases shaded. `pad` counts from 0.
std::string pad_figure(const TrialTrace& trace, std::size_t pad, const svg::Range& range) {
  const std::string name = "pad " + std::to_string(pad + 1);
  Canvas canvas(240, 180, name + ": counts over time", "plot small");
  const Axes axes({42, 32, 192, 104}, {0, end_of(trace)}, range);
  shade_phases(canvas, axes, trace.phases);
  axes.draw_x(canvas, "time [s]", 4);
  axes.draw_y(canvas, "", 4);
  name_phases(canvas, axes, trace.phases);
  canvas.polyline(in_axes(axes, trace.pads[pad], 170), "curve first thin");
  canvas.text({4, 12}, name, "pad-name");
  canvas.text({52, 12}, "[counts]", "tick");
  return canvas.finish();
}

/// RMS and worst force error of each fabric against the band.
std::string fabric_force_figure(const std::vector<FabricForce>& fabrics,
                                std::optional<double> band_n) {
  const double row = 20, height = row * static_cast<double>(fabrics.size());
  double most = band_n ? *band_n * 1.1 : 0;
  for (const FabricForce& f : fabrics) most = std::max(most, f.tally.worst_n * 1.05);
  Canvas canvas(wide, height + 82, "Force error in phase M by fabric", "plot");
  const Axes axes({100, 34, wide - 120, height}, {0, most > 0 ? most : 1}, {0, 1});
  axes.draw_x(canvas, "force error in phase M [N]", 8);
  double y = axes.area.y;
  for (const FabricForce& f : fabrics) {
    canvas.text({92, y + 14}, f.fabric, "row-name", Anchor::end);
    canvas.rect({axes.x(0), y + 4, axes.x(f.tally.rms_n()) - axes.x(0), row - 8}, "bar");
    canvas.circle({axes.x(f.tally.worst_n), y + row / 2}, 4, "worst-mark");
    y += row;
  }
  if (band_n) canvas.line(axes.at(*band_n, 0), axes.at(*band_n, 1), "limit");
  const double x = key(canvas, 100, 18, "RMS", "bar");
  canvas.circle({x + 4, 14}, 4, "worst-mark");
  canvas.text({x + 13, 18}, "worst sample", "key");
  canvas.line({x + 120, 14}, {x + 140, 14}, "limit");
  if (band_n) canvas.text({x + 146, 18}, "edge of the band", "key");
  return canvas.finish();
}

struct Share {
  std::string name;
  double seconds = 0;
};

/// The parts of the run's wall time; what was not attributed is the last part.
std::vector<Share> wall_shares(const CampaignSummary& run) {
  std::vector<Share> out = {{"plant and emulators", run.time.plant_and_emulators_s},
                            {"drivers, control and engine", run.time.drivers_and_control_s},
                            {"recorder", run.time.recorder_s}};
  double rest_s = run.wall_s;
  for (const Share& share : out) rest_s -= share.seconds;
  out.push_back({"everything else", std::max(0.0, rest_s)});
  return out;
}

std::string share_figure(const std::vector<Share>& shares) {
  double total_s = 0;
  for (const Share& share : shares) total_s += share.seconds;
  Canvas canvas(wide, 44, "Where the wall time of the run went", "plot");
  double x = 0;
  for (std::size_t i = 0; i < shares.size() && total_s > 0; ++i) {
    const double width = shares[i].seconds / total_s * wide;
    const std::string number = std::to_string(i + 1);
    canvas.rect({x, 6, std::max(0.0, width - 1), 32}, "share share-" + number);
    if (width > 46)
      canvas.text({x + width / 2, 27}, percent(shares[i].seconds / total_s, 0) + " %",
                  "share-text share-text-" + number, Anchor::middle);
    x += width;
  }
  return canvas.finish();
}

constexpr std::string_view phases_key =
    "Phases: <b>S</b> resting under the sensor\u2019s own weight, <b>P</b> force controlled "
    "without "
    "motion, <b>M</b> motion at constant force, <b>E</b> resting again. Blank: between phases, "
    "while the force settles or the probe comes to rest; not part of the data set.";

std::string format_trial(const TrialRecord& record) {
  return escape(record.spec.label) + ", " + escape(record.spec.exploration) + ", repetition " +
         std::to_string(record.spec.repetition);
}

std::string force_caption(const TrialRecord& record) {
  std::string out = "Force on the plate, " + format_trial(record) +
                    ": the trial whose force error is the median of its exploration";
  if (record.quality.force_rms_error_n)
    out += " (" + fixed(*record.quality.force_rms_error_n * 1e3, 1) + " mN RMS while held)";
  return out + ". " + std::string(phases_key);
}

std::string pad_pictures(const TrialTrace& trace) {
  const svg::Range range = pad_range(trace);
  std::string out = "<div class=\"pads\">\n";
  for (std::size_t pad = 0; pad < trace.pads.size(); ++pad) out += pad_figure(trace, pad, range);
  return out + "</div>\n";
}

std::vector<std::string> force_cells(const std::string& name, std::size_t trials,
                                     const ForceTally& tally,
                                     const std::optional<RestForces>& rest) {
  const auto newtons = [&](double RestForces::*phase) {
    return rest ? fixed((*rest).*phase, 3) : std::string();
  };
  return {name,
          thousands(trials),
          thousands(tally.samples),
          fixed(tally.rms_n() * 1e3, 1),
          fixed(tally.worst_n * 1e3, 0),
          percent(in_band_share(tally), 2),
          newtons(&RestForces::before_n),
          newtons(&RestForces::after_n)};
}

std::string force_table(const ReportInput& input, const std::vector<FabricForce>& fabrics) {
  HtmlTable table({"fabric", "trials", "samples", "RMS error [mN]", "worst [mN]", "in band [%]",
                   "rest S [N]", "rest E [N]"});
  for (const FabricForce& f : fabrics)
    table.row(force_cells(escape(f.fabric), f.trials, f.tally, f.rest));
  const char* const all =
      input.verified == nullptr ? "<b>run\u2019s own tally</b>" : "<b>all fabrics</b>";
  table.row(force_cells(all, input.run.trials_complete, input.run.force, {}));
  return table.finish();
}

std::string format_targets(const std::vector<ForceTarget>& targets) {
  std::string out;
  for (const ForceTarget& t : targets)
    out += (out.empty() ? "" : "; ") + escape(t.exploration) + " " + fixed(t.force_n, 2) +
           " N \u00B1 " + fixed(t.band_n, 2) + " N";
  return out;
}

}  // namespace

std::string trace_section(const ReportInput& input) {
  const Dataset& dataset = input.dataset;
  std::string exploration;
  for (const TrialRecord& record : dataset.records)
    if (exploration.empty()) exploration = record.spec.exploration;
  const auto chosen = typical_trial(dataset, exploration);
  if (!chosen) return {};
  const TrialTrace trace = extract_trace(dataset, *chosen);
  const std::string badge = badge_html(input);
  std::string out = "<section>\n<h2>One trial</h2>\n";
  if (trace.record->wrench.samples() > 0) {
    const auto target = find_target(force_targets(dataset.info), trace.record->spec.exploration);
    out += figure("<div class=\"scroll\">" + force_figure(trace, target) + "</div>\n",
                  force_caption(*trace.record), badge);
  }
  if (trace.pads.empty()) return out + "<p>No taxels recorded.</p>\n</section>\n";
  out += figure(pad_pictures(trace),
                "What the " + std::to_string(trace.pads.size()) +
                    " pads of the tactile sensor felt meanwhile: counts above each pad\u2019s mean "
                    "in phase S over time [s], all with the same axes (compare the paper\u2019s "
                    "Figure 5, one pad on real cloth).",
                badge);
  return out + "</section>\n";
}

std::string force_section(const ReportInput& input) {
  const std::vector<ForceTarget> targets = force_targets(input.dataset.info);
  const std::vector<FabricForce> fabrics = force_by_fabric(input.dataset, targets);
  if (fabrics.empty()) return {};
  const std::string badge = badge_html(input);
  std::string out = "<section>\n<h2>How well the force was held</h2>\n";
  out += figure(
      "<div class=\"scroll\">" + fabric_force_figure(fabrics, targets.front().band_n) + "</div>\n",
      "Normal force against its set point while the probe moved (" + format_targets(targets) +
          "). The paper prints no such figure.",
      badge);
  out +=
      "<details><summary>As a table</summary>\n" +
      figure(force_table(input, fabrics),
             std::string("Computed again from the recorded wrench between the first and the "
                         "last taxel sample of phase M. Rest: the mean force of phase S or E that "
                         "is furthest from the probe\u2019s weight") +
                 (fabrics.front().rest ? " of " + fixed(fabrics.front().rest->weight_n, 3) + " N"
                                       : "") +
                 (input.verified == nullptr ? "; the last row is what the run counted while it ran."
                                            : "."),
             badge) +
      "</details>\n";
  return out + "</section>\n";
}

std::string wall_time_section(const ReportInput& input) {
  const CampaignSummary& run = input.run;
  if (!(run.wall_s > 0)) return {};
  const std::vector<Share> shares = wall_shares(run);
  HtmlTable table({"part", "time", "share [%]"});
  for (std::size_t i = 0; i < shares.size(); ++i)
    table.row(
        {"<i class=\"swatch share-" + std::to_string(i + 1) + "\"></i>" + escape(shares[i].name),
         duration(shares[i].seconds), percent(shares[i].seconds / run.wall_s)});
  table.row({"<b>run</b>", "<b>" + duration(run.wall_s) + "</b>", "100"});
  table.row({"export to HDF5, afterwards", duration(run.time.export_s), std::string(no_value)});
  return "<section>\n<h2>Where the wall time went</h2>\n" +
         figure(share_figure(shares) + table.finish(),
                "Wall time of the run on this machine, attributed by timing one call in sixteen; " +
                    duration(run.virtual_s) + " of bench time, " +
                    thousands(static_cast<std::size_t>(run.events)) + " timer and link events.",
                badge_html(input)) +
         "</section>\n";
}

}  // namespace weft::daemon
