#include "daemon/analysis/report/evaluation_figures.hpp"

#include <algorithm>
#include <numeric>

#include "daemon/pages/plot/marks.hpp"
#include "daemon/pages/plot/svg.hpp"

namespace weft::daemon {
namespace {

using svg::Anchor;
using svg::Axes;
using svg::Canvas;

constexpr double page_width = 560;

void draw_counts(Canvas& canvas, const Axes& axes, const classifier::Reliability& figures) {
  std::size_t most = 1;
  for (const auto& bin : figures.bins) most = std::max(most, bin.count);
  for (const auto& bin : figures.bins) {
    const double share = static_cast<double>(bin.count) / static_cast<double>(most);
    const double left = axes.x(bin.low) + 2, right = axes.x(bin.high) - 2;
    const double top = axes.y(share);
    canvas.rect({left, top, right - left, axes.y(0) - top}, "bar", 0.5);
    if (bin.count > 0)
      canvas.text({(left + right) / 2, top - 4}, std::to_string(bin.count), "tick", Anchor::middle);
  }
}

void draw_bins(Canvas& canvas, const Axes& axes, const classifier::CalibrationCheck& check) {
  for (std::size_t b = 0; b < check.bins.size(); ++b) {
    const classifier::ReliabilityBin& bin = check.reliability.bins[b];
    if (bin.count == 0) continue;
    const classifier::Interval& sure = check.bins[b].observed_ci95;
    canvas.line(axes.at(bin.predicted, sure.low), axes.at(bin.predicted, sure.high), "interval");
    canvas.circle(axes.at(bin.predicted, bin.observed), 4.5, "mark");
  }
}

svg::Range accuracy_range(const std::vector<CurvePoint>& curve) {
  std::vector<double> values;
  for (const CurvePoint& point : curve)
    for (const CurveValue& value : point.values) {
      values.push_back((value.accuracy - value.deviation) * 100);
      values.push_back((value.accuracy + value.deviation) * 100);
    }
  svg::Range out = svg::find_range(values);
  out.high = std::min(out.high, 100.5);
  return out;
}

// The points of learner `k`, in pixels.
std::vector<svg::Point> make_points(const Axes& axes, const std::vector<CurvePoint>& curve,
                                    std::size_t k) {
  std::vector<svg::Point> out;
  for (const CurvePoint& point : curve)
    out.push_back(axes.at(static_cast<double>(point.trials), point.values[k].accuracy * 100));
  return out;
}

void draw_learner(Canvas& canvas, const Axes& axes, const std::vector<CurvePoint>& curve,
                  std::size_t k) {
  const std::vector<svg::Point> points = make_points(axes, curve, k);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const CurveValue& value = curve[i].values[k];
    const double low = axes.y((value.accuracy - value.deviation) * 100);
    const double high = axes.y(std::min(1.0, value.accuracy + value.deviation) * 100);
    canvas.line({points[i].x, low}, {points[i].x, high}, "whisker " + mark_class(k));
    if (i > 0) canvas.line(points[i - 1], points[i], "curve " + mark_class(k));
  }
  for (const svg::Point& point : points) draw_mark(canvas, point, k);
}

// Names one below the other, as near to where their lines end as their height allows.
void draw_names(Canvas& canvas, const Axes& axes, const CurvePoint& last) {
  constexpr double height = 15;
  std::vector<double> y;
  for (const CurveValue& value : last.values) y.push_back(axes.y(value.accuracy * 100));
  std::vector<std::size_t> order(y.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return y[k]; });
  for (std::size_t i = 1; i < order.size(); ++i)
    y[order[i]] = std::max(y[order[i]], y[order[i - 1]] + height);
  double bottom = axes.area.y + axes.area.height;
  for (std::size_t i = order.size(); i-- > 0; bottom -= height)
    y[order[i]] = bottom = std::min(y[order[i]], bottom);
  const double x = axes.x(static_cast<double>(last.trials)) + 20;
  for (std::size_t k = 0; k < y.size(); ++k) {
    draw_mark(canvas, {x, y[k]}, k);
    canvas.text({x + 10, y[k] + 4}, last.values[k].learner, "key");
  }
}

}  // namespace

std::string reliability_figure(const classifier::CalibrationCheck& check, std::string_view title) {
  Canvas canvas(page_width, 470, title, "plot narrow");
  const Axes axes({60, 16, page_width - 84, 280}, {0, 1}, {0, 1});
  axes.draw_x(canvas, "probability said", 10);
  axes.draw_y(canvas, "share that was right", 5);
  canvas.line(axes.at(0, 0), axes.at(1, 1), "limit");
  draw_bins(canvas, axes, check);
  const Axes counts({60, 370, page_width - 84, 80}, {0, 1}, {0, 1});
  canvas.line(counts.at(0, 0), counts.at(1, 0), "axis");
  canvas.text({60, 356}, "answers", "key");
  draw_counts(canvas, counts, check.reliability);
  return canvas.finish();
}

std::string learning_curve_figure(const std::vector<CurvePoint>& curve) {
  if (curve.empty()) return {};
  Canvas canvas(page_width, 330, "Accuracy against training trials of each label", "plot narrow");
  const double last = static_cast<double>(curve.back().trials);
  const Axes axes({60, 16, page_width - 170, 256}, {0, last * 1.04}, accuracy_range(curve));
  axes.draw_x(canvas, "training trials of each label", 8);
  axes.draw_y(canvas, "accuracy [%]", 6);
  for (std::size_t k = 0; k < curve.front().values.size(); ++k)
    draw_learner(canvas, axes, curve, k);
  draw_names(canvas, axes, curve.back());
  return canvas.finish();
}

}  // namespace weft::daemon
