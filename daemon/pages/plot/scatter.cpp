#include "daemon/pages/plot/scatter.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"
#include "daemon/pages/plot/svg.hpp"

namespace weft::daemon {
namespace {

using svg::Anchor;
using svg::Axes;
using svg::Box;
using svg::Canvas;
using svg::Point;

constexpr double panel_width = 520, panel_height = 330, left = 62, gap = 28, top = 64;
constexpr double front_radius = 10;

constexpr std::string_view scatter_sheet = R"css(
.front-mark{fill:none;stroke:var(--ink);stroke-width:1.6}
.front-line{fill:none;stroke:var(--ink);stroke-width:1.4;stroke-dasharray:5 4}
svg .front-name{font-size:11.5px;font-weight:600}svg .panel-name{font-size:13px;font-weight:600}
svg .stamp{font-size:15px;font-weight:700;letter-spacing:.1em;fill:var(--badge-ink)}
.level-line{stroke:var(--badge-ink);stroke-width:1.3;stroke-dasharray:2 3}
svg .level-name{font-size:11.5px;fill:var(--badge-ink)}
.on-front th,.on-front td{font-weight:650}
)css";

svg::Range error_range(const Scatter& scatter) {
  std::vector<double> values;
  for (const ScatterPanel& panel : scatter.panels) {
    for (const ScatterPoint& p : panel.points) values.push_back(p.share);
    for (const ScatterLine& line : panel.lines) values.push_back(line.share);
  }
  return svg::log_range_of(values, 0.08);
}

svg::Range share_range(const Scatter& scatter) {
  double low = 1, high = 0;
  for (const ScatterPanel& panel : scatter.panels)
    for (const ScatterPoint& p : panel.points) {
      low = std::min({low, p.low, p.share});
      high = std::max({high, p.high, p.share});
    }
  low = std::max(0.0, std::floor(low * 20 - 0.1) / 20);
  high = std::min(1.0, std::ceil(high * 20 + 0.1) / 20);
  high = std::max(high, low + 0.05);
  return {low * 100, (high + 0.06 * (high - low)) * 100};  // room for a name above the topmost
}

svg::Range time_range(const ScatterPanel& panel) {
  std::vector<double> times;
  for (const ScatterPoint& p : panel.points) times.push_back(p.time_s);
  return svg::log_range_of(times, 0.08);
}

bool has_place(const ScatterPoint& p, bool errors) {
  return p.time_s > 0 && std::isfinite(p.time_s) && std::isfinite(p.share) &&
         (!errors || p.share > 0);
}

/// The value that an axis shows: shares in percent.
double shown(double share, bool errors) {
  return errors ? share : share * 100;
}

double text_width(const std::string& text) {
  return 7.0 * static_cast<double>(text.size());
}

bool overlap(const Box& a, const Box& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

Box around(Point at, double radius) {
  return {at.x - radius, at.y - radius, 2 * radius, 2 * radius};
}

Box span(Point a, Point b) {
  return {std::min(a.x, b.x) - 1, std::min(a.y, b.y) - 1, std::abs(a.x - b.x) + 2,
          std::abs(a.y - b.y) + 2};
}

/// Writes names beside their points where nothing has been written yet.
class Names {
 public:
  explicit Names(const Box& area) : area_(area) {}

  void write(Canvas& canvas, Point at, const std::string& text) {
    const Box box = place_for(at, text_width(text));
    taken_.push_back(box);
    canvas.text({box.x, box.y + 11}, text, "front-name");
  }

  void reserve(const Box& box) { taken_.push_back(box); }

 private:
  [[nodiscard]] bool is_free(const Box& box) const {
    return box.x >= area_.x && box.x + box.width <= area_.x + area_.width && box.y >= area_.y &&
           box.y + box.height <= area_.y + area_.height &&
           std::ranges::none_of(taken_, [&](const Box& other) { return overlap(box, other); });
  }

  // The nearest free place left or right of the point, else the nearest.
  [[nodiscard]] Box place_for(Point at, double width) const {
    constexpr double height = 14;
    const double left_x = at.x - width - front_radius - 1, right_x = at.x + front_radius + 3;
    std::vector<Box> places;
    for (double shift = 0; shift < 6 * height; shift += height) {
      places.push_back({left_x, at.y - 18 - shift, width, height});
      places.push_back({right_x, at.y + 4 + shift, width, height});
      places.push_back({right_x, at.y - 16 - shift, width, height});
      places.push_back({left_x, at.y + 4 + shift, width, height});
    }
    const auto free = std::ranges::find_if(places, [&](const Box& b) { return is_free(b); });
    return free == places.end() ? places.front() : *free;
  }

  Box area_;
  std::vector<Box> taken_;
};

// Up to each time, what the best choice reaches.
std::vector<Point> staircase(const Axes& axes, std::vector<const ScatterPoint*> front) {
  const bool errors = axes.y.logarithmic;
  std::ranges::stable_sort(front, {}, [](const ScatterPoint* p) { return p->time_s; });
  std::vector<Point> stairs;
  for (const ScatterPoint* p : front) {
    const Point at = axes.at(p->time_s, shown(p->share, errors));
    if (!stairs.empty()) stairs.push_back({at.x, stairs.back().y});
    stairs.push_back(at);
  }
  return stairs;
}

void draw_point(Canvas& canvas, const Axes& axes, const ScatterPoint& p) {
  if (axes.y.logarithmic) return draw_mark(canvas, axes.at(p.time_s, p.share), p.family);
  const Point low = axes.at(p.time_s, p.low * 100), high = axes.at(p.time_s, p.high * 100);
  const std::string whisker = "whisker " + mark_class(p.family);
  canvas.line(low, high, whisker);
  canvas.line({low.x - 3, low.y}, {low.x + 3, low.y}, whisker);
  canvas.line({high.x - 3, high.y}, {high.x + 3, high.y}, whisker);
  draw_mark(canvas, axes.at(p.time_s, p.share * 100), p.family);
}

void draw_lines(Canvas& canvas, const Axes& axes, const ScatterPanel& panel, Names& names) {
  const double right = axes.area.x + axes.area.width;
  for (const ScatterLine& line : panel.lines) {
    const double y = axes.y(shown(line.share, axes.y.logarithmic));
    canvas.line({axes.area.x, y}, {right, y}, "level-line");
    const double text_y = line.below ? y + 12 : y - 4;
    canvas.text({right - 4, text_y}, line.label, "level-name", Anchor::end);
    names.reserve({right - 4 - text_width(line.label), text_y - 12, text_width(line.label), 16});
  }
}

void draw_panel(Canvas& canvas, const Axes& axes, const ScatterPanel& panel) {
  const bool errors = axes.y.logarithmic;
  if (panel.counts)
    axes.draw_log_x(canvas, panel.x_title, general);
  else
    axes.draw_log_x(canvas, panel.x_title, tick_text);
  canvas.text({axes.area.x, axes.area.y - 8}, panel.title, "panel-name");
  std::vector<const ScatterPoint*> front;
  Names names(axes.area);
  draw_lines(canvas, axes, panel, names);
  for (const ScatterPoint& p : panel.points) {
    if (!has_place(p, errors)) continue;
    draw_point(canvas, axes, p);
    names.reserve(around(axes.at(p.time_s, shown(p.share, errors)), p.front ? front_radius : 6));
    if (p.front) front.push_back(&p);
  }
  const std::vector<Point> stairs = staircase(axes, front);
  canvas.polyline(stairs, "front-line");
  for (std::size_t k = 1; k < stairs.size(); ++k) names.reserve(span(stairs[k - 1], stairs[k]));
  for (const ScatterPoint* p : front) {
    const Point at = axes.at(p->time_s, shown(p->share, errors));
    canvas.diamond(at, front_radius, "front-mark");
    names.write(canvas, at, p->label);
  }
}

/// Five letters at most: the axis title is beside them.
std::string error_text(double error) {
  if (error > 0.9e-3) return general(error);
  const double power = std::floor(std::log10(error) + 1e-9);
  return general(std::round(error / std::pow(10.0, power))) + "e" + general(power);
}

void draw_heights(Canvas& canvas, const Axes& axes, const std::string& title, bool first) {
  if (axes.y.logarithmic) {
    if (first) return axes.draw_log_y(canvas, title, error_text);
    return axes.draw_log_y_grid(canvas);
  }
  if (first) return axes.draw_y(canvas, title, 8);
  axes.draw_y_grid(canvas, 8);
}

bool is_present(const Scatter& scatter, std::size_t family) {
  return std::ranges::any_of(scatter.panels, [&](const ScatterPanel& panel) {
    return std::ranges::find(panel.points, family, &ScatterPoint::family) != panel.points.end();
  });
}

void draw_legend(Canvas& canvas, const Scatter& scatter) {
  double x = left;
  for (std::size_t f = 0; f < scatter.families.size(); ++f) {
    if (!is_present(scatter, f)) continue;
    draw_mark(canvas, {x + 5, 14}, f);
    canvas.text({x + 15, 18}, scatter.families[f], "key");
    x += 32 + text_width(scatter.families[f]);
  }
  const bool has_front = std::ranges::any_of(scatter.panels, [](const ScatterPanel& panel) {
    return std::ranges::any_of(panel.points, &ScatterPoint::front);
  });
  if (!has_front) return;
  canvas.diamond({x + 10, 14}, front_radius, "front-mark");
  canvas.text({x + 25, 18}, "on the front: none is as accurate in less time", "key");
}

using classifier::Confusion;

constexpr double left_edge = 76, top_edge = 74, edge = 6;

std::size_t row_sum(const Confusion& confusion, std::size_t row) {
  std::size_t sum = 0;
  for (std::size_t k = 0; k < confusion.classes(); ++k) sum += confusion.at(row, k);
  return sum;
}

double share_of_row(const Confusion& confusion, std::size_t truth, std::size_t predicted) {
  const std::size_t sum = row_sum(confusion, truth);
  return sum == 0 ? 0
                  : static_cast<double>(confusion.at(truth, predicted)) / static_cast<double>(sum);
}

// The root, so that a single mistake among hundreds is still seen; the same on and off the
// diagonal, so that both colours compare.
double shade(double share) {
  return 0.12 + 0.88 * std::sqrt(share);
}

void draw_cell(svg::Canvas& canvas, const Confusion& confusion, std::size_t truth,
               std::size_t predicted, const svg::Box& box) {
  const std::size_t count = confusion.at(truth, predicted);
  const bool diagonal = truth == predicted;
  if (count == 0) {
    canvas.rect(box, diagonal ? "cell-diagonal" : "cell-empty");
    return;
  }
  const double opacity = shade(share_of_row(confusion, truth, predicted));
  canvas.rect(box, diagonal ? "cell-hit" : "cell-miss", opacity);
  const double middle = box.x + box.width / 2;
  canvas.text({middle, box.y + box.height / 2 + 3.5}, std::to_string(count),
              opacity > 0.72 ? "cell-text on" : "cell-text", svg::Anchor::middle);
}

struct Mistake {
  std::size_t truth;
  std::size_t predicted;
  std::size_t count;
};

std::vector<Mistake> list_mistakes(const Confusion& confusion) {
  std::vector<Mistake> out;
  for (std::size_t t = 0; t < confusion.classes(); ++t)
    for (std::size_t p = 0; p < confusion.classes(); ++p)
      if (t != p && confusion.at(t, p) > 0) out.push_back({t, p, confusion.at(t, p)});
  std::stable_sort(out.begin(), out.end(),
                   [](const Mistake& a, const Mistake& b) { return a.count > b.count; });
  return out;
}

}  // namespace

std::string scatter_figure(const Scatter& scatter) {
  const auto panels = static_cast<double>(scatter.panels.size());
  const double width = left + panels * panel_width + (panels - 1) * gap + 12;
  Canvas canvas(width, top + panel_height + 44, scatter.words, "plot");
  draw_legend(canvas, scatter);
  canvas.text({width - 12, top - 8}, scatter.stamp, "stamp", Anchor::end);
  const svg::Range shares = scatter.errors ? error_range(scatter) : share_range(scatter);
  for (std::size_t k = 0; k < scatter.panels.size(); ++k) {
    const double x = left + static_cast<double>(k) * (panel_width + gap);
    Axes axes({x, top, panel_width, panel_height}, time_range(scatter.panels[k]), shares);
    axes.x.logarithmic = true;
    axes.y.logarithmic = scatter.errors;
    draw_heights(canvas, axes, scatter.y_title, k == 0);
    draw_panel(canvas, axes, scatter.panels[k]);
  }
  return canvas.finish();
}

std::string_view scatter_style() {
  return scatter_sheet;
}

std::string confusion_map(const Confusion& confusion, std::string_view title) {
  const std::size_t n = confusion.classes();
  const double cell = n > 24 ? 18 : n > 10 ? 25 : 36;
  const double side = cell * static_cast<double>(n);
  svg::Canvas canvas(left_edge + side + edge, top_edge + side + 26, title, "heat");
  for (std::size_t i = 0; i < n; ++i) {
    const double centre = (static_cast<double>(i) + 0.5) * cell;
    canvas.text({left_edge - 6, top_edge + centre + 4}, confusion.labels[i], "tick",
                svg::Anchor::end);
    canvas.text({left_edge + centre + 4, top_edge - 6}, confusion.labels[i], "tick",
                svg::Anchor::start, true);
    for (std::size_t k = 0; k < n; ++k)
      draw_cell(canvas, confusion, i, k,
                {left_edge + static_cast<double>(k) * cell + 0.5,
                 top_edge + centre - cell / 2 + 0.5, cell - 1, cell - 1});
  }
  canvas.text({left_edge + side / 2, top_edge + side + 18}, "columns: taken for; rows: true fabric",
              "axis-title", svg::Anchor::middle);
  return canvas.finish();
}

std::string worst_confusions(const Confusion& confusion, std::size_t count) {
  const std::vector<Mistake> mistakes = list_mistakes(confusion);
  if (mistakes.empty()) return "No trial was taken for another fabric.";
  std::string out = "Most frequent: ";
  for (std::size_t i = 0; i < std::min(count, mistakes.size()); ++i) {
    const Mistake& m = mistakes[i];
    if (i > 0) out += "; ";
    out += confusion.labels[m.truth] + " taken for " + confusion.labels[m.predicted] + " " +
           thousands(m.count) + (m.count == 1 ? " time" : " times") + " (" +
           percent(share_of_row(confusion, m.truth, m.predicted)) + " %)";
  }
  return out + ".";
}

}  // namespace weft::daemon
