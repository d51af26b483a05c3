#include <algorithm>
#include <cmath>

#include "daemon/analysis/report/paper.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/analysis/report/trace.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/document.hpp"

namespace weft::daemon {
namespace {

constexpr std::size_t most_pads = 64;  // with more taxels, individual pictures are useless

std::vector<chart::Span> spans_of(const TrialTrace& trace) {
  std::vector<chart::Span> out;
  for (const PhaseSpan& span : trace.phases)
    out.push_back({span.begin_s, span.end_s, std::string(1, to_char(span.phase))});
  return out;
}

/// Rounds to four digits, more than a picture shows.
double rounded(double value) {
  if (value == 0 || !std::isfinite(value)) return value;
  const double power = std::pow(10.0, 4 - std::ceil(std::log10(std::abs(value))));
  return std::round(value * power) / power;
}

chart::Series line_of(std::string name, std::size_t family, const Curve& curve, std::size_t buckets,
                      chart::Line line) {
  chart::Series out{std::move(name), family, line, false};
  for (const TracePoint& p : thinned(curve, buckets))
    out.points.push_back({rounded(p.x), rounded(p.y)});
  return out;
}

/// Normal and tangential force over time, phases shaded, set point and band if known.
chart::Plot force_plot(const TrialTrace& trace, const std::optional<ForceTarget>& target) {
  chart::Panel panel{{}, {.title = "time [s]", .low = 0}, {.title = "force [N]"}, spans_of(trace)};
  chart::Plot out{"Force over time of one trial, phases shaded"};
  out.width = 1000;
  if (target) {
    for (const PhaseSpan& span : trace.phases)
      if (span.phase == Phase::motion || span.phase == Phase::press)
        panel.areas.push_back({span.begin_s, span.end_s, target->force_n - target->band_n,
                               target->force_n + target->band_n});
    out.area_name = "set point " + fixed(target->force_n, 1) + " N, band \u00B1" +
                    fixed(target->band_n, 2) + " N";
  }
  panel.series = {line_of("tangential force", 2, trace.tangential_n, 300, chart::Line::thin),
                  line_of("normal force", 1, trace.normal_n, 400, chart::Line::solid)};
  out.panels = {std::move(panel)};
  return out;
}

/// Counts of each taxel over time on the same axes, four per row.
chart::Plot pads_plot(const TrialTrace& trace) {
  chart::Plot out{"Counts of each taxel over time, phases shaded"};
  out.columns = 4;
  out.panel_height = 90;
  out.width = 1000;
  out.shared_x = out.shared_y = true;
  for (std::size_t pad = 0; pad < trace.pads.size(); ++pad) {
    chart::Panel panel{"taxel " + std::to_string(pad + 1),
                       {.title = "time [s]", .low = 0},
                       {.title = "counts"},
                       spans_of(trace)};
    panel.series = {line_of({}, 1, trace.pads[pad], 90, chart::Line::thin)};
    out.panels.push_back(std::move(panel));
  }
  return out;
}

/// RMS and worst force error of each fabric, with the band.
chart::Rows fabric_forces(const std::vector<FabricForce>& fabrics, std::optional<double> band_n) {
  chart::Rows out{"Force error in phase M by fabric",
                  {.title = "force error in phase M [mN]", .low = 0},
                  "RMS"};
  out.mark_names = {"", "worst sample"};
  out.bars = true;
  out.width = 1000;
  if (band_n) {
    out.limit = *band_n * 1e3;
    out.limit_name = "edge of the band";
  }
  for (const FabricForce& f : fabrics)
    out.rows.push_back({f.fabric,
                        rounded(f.tally.rms_n() * 1e3),
                        chart::no_number,
                        chart::no_number,
                        {chart::no_number, rounded(f.tally.worst_n * 1e3)}});
  return out;
}

struct Share {
  std::string name;
  double seconds = 0;
};

/// The parts of the run's wall time; time that was not attributed is the last part.
std::vector<Share> wall_shares(const CampaignSummary& run) {
  std::vector<Share> out = {{"plant and emulators", run.time.plant_and_emulators_s},
                            {"drivers, control and engine", run.time.drivers_and_control_s},
                            {"recorder", run.time.recorder_s}};
  double rest_s = run.wall_s;
  for (const Share& share : out) rest_s -= share.seconds;
  out.push_back({"everything else", std::max(0.0, rest_s)});
  return out;
}

chart::Shares share_chart(const std::vector<Share>& shares) {
  chart::Shares out{"Parts of the wall time of the run"};
  for (const Share& share : shares) out.parts.emplace_back(share.name, share.seconds);
  return out;
}

constexpr std::string_view phases_key =
    "Phases: <b>S</b> rest under the weight of the probe, <b>P</b> force control without "
    "motion, <b>M</b> motion at constant force, <b>E</b> rest again. Blank: between phases, "
    "while the force settles or the probe comes to rest; not part of the data set.";

std::string format_trial(const TrialRecord& record) {
  return escape(record.spec.label) + ", " + escape(record.spec.exploration) + ", repetition " +
         std::to_string(record.spec.repetition);
}

std::string force_caption(const TrialRecord& record) {
  std::string out = "Force on the plate, " + format_trial(record) +
                    ": the trial with the median force error of its exploration";
  if (record.quality.force_rms_error_n)
    out +=
        " (" + fixed(*record.quality.force_rms_error_n * 1e3, 1) + " mN RMS under force control)";
  return out + ". " + std::string(phases_key);
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
          significant(tally.rms_n() * 1e3),
          significant(tally.worst_n * 1e3),
          percent(in_band_share(tally), 2),
          newtons(&RestForces::before_n),
          newtons(&RestForces::after_n)};
}

Blocks force_table(const ReportInput& input, const std::vector<FabricForce>& fabrics) {
  HtmlTable table({"fabric", "trials", "samples", "RMS error [mN]", "worst [mN]", "in band [%]",
                   "rest S [N]", "rest E [N]"});
  for (const FabricForce& f : fabrics)
    table.row(force_cells(escape(f.fabric), f.trials, f.tally, f.rest));
  const char* const all =
      input.verified == nullptr ? "<b>counted during the run</b>" : "<b>all fabrics</b>";
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

Blocks trace_section(const ReportInput& input) {
  const Dataset& dataset = input.dataset;
  std::string exploration;
  for (const TrialRecord& record : dataset.records)
    if (exploration.empty()) exploration = record.spec.exploration;
  const auto chosen = typical_trial(dataset, exploration);
  if (!chosen) return {};
  const TrialTrace trace = extract_trace(dataset, *chosen);
  const std::string badge = badge_html(input);
  Blocks out;
  if (trace.record->wrench.samples() > 0) {
    const auto target = find_target(force_targets(dataset.info), trace.record->spec.exploration);
    out += figure(picture(force_plot(trace, target)), force_caption(*trace.record), badge);
  }
  if (trace.pads.empty()) out += paragraph("No taxels recorded.");
  if (trace.pads.empty() || trace.pads.size() > most_pads) return section("One trial", out);
  out += figure(picture(pads_plot(trace)),
                "Counts of the " + std::to_string(trace.pads.size()) +
                    " taxels over time [s], above the mean of each taxel in phase S. All have the "
                    "same axes (compare the paper\u2019s Figure 5, one taxel on real fabric).",
                badge);
  return section("One trial", out);
}

Blocks force_section(const ReportInput& input) {
  const std::vector<ForceTarget> targets = force_targets(input.dataset.info);
  const std::vector<FabricForce> fabrics = force_by_fabric(input.dataset, targets);
  if (fabrics.empty()) return {};
  const std::string badge = badge_html(input);
  Blocks out = figure(picture(fabric_forces(fabrics, targets.front().band_n)),
                      "Error of the normal force from its set point in phase M (" +
                          format_targets(targets) + "). The paper has no such figure.",
                      badge);
  out += details(
      "As a table",
      figure(force_table(input, fabrics),
             std::string("Computed from the recorded wrench between the first and the last taxel "
                         "sample of phase M. Rest: the mean force of phase S or E with the largest "
                         "difference from the weight of the probe") +
                 (fabrics.front().rest ? " of " + fixed(fabrics.front().rest->weight_n, 3) + " N"
                                       : "") +
                 (input.verified == nullptr ? ". The last row was counted during the run." : "."),
             badge));
  return section("Force control", out);
}

Blocks wall_time_details(const ReportInput& input) {
  const CampaignSummary& run = input.run;
  if (!(run.wall_s > 0)) return {};
  const std::vector<Share> shares = wall_shares(run);
  HtmlTable table({"part", "time", "share [%]"});
  for (std::size_t i = 0; i < shares.size(); ++i)
    table.row(
        {"<i class=\"swatch share-" + std::to_string(i + 1) + "\"></i>" + escape(shares[i].name),
         duration(shares[i].seconds), percent(shares[i].seconds / run.wall_s)});
  table.row({"<b>run</b>", "<b>" + duration(run.wall_s) + "</b>", "100"});
  table.row({"export to HDF5 after the run", duration(run.time.export_s), std::string(no_value)});
  return details(
      "Wall time of the run",
      figure(picture(share_chart(shares)) + details("As a table", table.finish()),
             "Wall time of the run on this computer, estimated from one timed call in sixteen; " +
                 duration(run.virtual_s) + " of bench time, " +
                 thousands(static_cast<std::size_t>(run.events)) + " timer and link events.",
             badge_html(input)));
}

}  // namespace weft::daemon
