#include "daemon/analysis/report/figures.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/analysis/report/paper.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

using svg::Anchor;
using svg::Axes;
using svg::Canvas;
using svg::Range;

constexpr double wide = 760;
constexpr double narrow = 560;  // fits a phone without scrolling

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

std::string_view reduction_text(classifier::Reduction reduction) {
  switch (reduction) {
    case classifier::Reduction::pvalue:
      return "p-value";
    case classifier::Reduction::pca:
      return "PCA";
    default:
      return "all features";
  }
}

double paper_accuracy(std::string_view exploration, classifier::Reduction reduction) {
  for (const paper::Accuracy& row : paper::accuracies) {
    if (row.exploration != exploration) continue;
    if (reduction == classifier::Reduction::pvalue) return row.pvalue;
    return reduction == classifier::Reduction::pca ? row.pca : row.all;
  }
  return -1;
}

double accuracy_floor(const std::vector<ExplorationResult>& results) {
  double least = 0.85;
  for (const ExplorationResult& result : results)
    for (const ReductionResult& r : result.reductions)
      least = std::min(least, r.evaluation.ci95.low);
  return std::max(0.0, std::floor(least * 20 - 0.2) / 20);
}

void draw_accuracy(Canvas& canvas, const Axes& axes, double y, const classifier::Evaluation& e) {
  const double low = axes.x(e.ci95.low * 100), high = axes.x(e.ci95.high * 100);
  canvas.line({low, y}, {high, y}, "interval");
  canvas.line({low, y - 4}, {low, y + 4}, "interval");
  canvas.line({high, y - 4}, {high, y + 4}, "interval");
  canvas.circle({axes.x(e.accuracy * 100), y}, 5, "mark");
}

}  // namespace

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

svg::Range pad_range(const TrialTrace& trace) {
  std::vector<double> values;
  for (const Curve& pad : trace.pads)
    values.insert(values.end(), pad.value.begin(), pad.value.end());
  return svg::find_range(values);
}

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

std::string accuracy_figure(const std::vector<ExplorationResult>& results) {
  std::size_t rows = 0;
  for (const ExplorationResult& result : results) rows += result.reductions.size();
  const double height =
      26.0 * static_cast<double>(rows) + 10.0 * static_cast<double>(results.size());
  Canvas canvas(narrow, height + 86, "Accuracy by exploration and reduction", "plot narrow");
  const Axes axes({150, 34, narrow - 170, height}, {accuracy_floor(results) * 100, 100.5}, {0, 1});
  axes.draw_x(canvas, "accuracy [%]", 8);
  double y = axes.area.y + 16;
  for (const ExplorationResult& result : results) {
    for (const ReductionResult& r : result.reductions) {
      canvas.text({140, y + 4},
                  result.exploration + "  " + std::string(reduction_text(r.reduction)), "row-name",
                  Anchor::end);
      const double printed = paper_accuracy(result.exploration, r.reduction);
      if (printed >= 0) canvas.diamond({axes.x(printed * 100), y}, 7, "paper-mark");
      draw_accuracy(canvas, axes, y, r.evaluation);
      y += 26;
    }
    y += 10;
  }
  canvas.circle({20, 14}, 5, "mark");
  canvas.text({31, 18}, "this run, with 95 % interval", "key");
  canvas.diamond({236, 14}, 7, "paper-mark");
  canvas.text({248, 18}, "printed in the paper, real fabrics", "key");
  return canvas.finish();
}

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

}  // namespace weft::daemon
