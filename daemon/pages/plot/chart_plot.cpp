#include <algorithm>
#include <cmath>
#include <set>

#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/marks.hpp"

namespace weft::daemon::chart {
namespace {

using svg::Anchor;
using svg::Box;
using svg::Canvas;
using svg::Point;
using svg::Sheet;
namespace text = svg::text;

constexpr double panel_gap = 16, panel_edge = 12, panel_title_row = 19, span_row = 15,
                 axis_title_column = 18;
constexpr double row_of_ticks = 36, label_height = 14;

/// Position of a panel, and the mapping of its data to the picture.
struct Place {
  Box area;
  svg::Scale x, y;
  bool x_numbers = true;
  bool y_numbers = true;

  [[nodiscard]] Point at(double x_value, double y_value) const { return {x(x_value), y(y_value)}; }
  [[nodiscard]] double right() const { return area.x + area.width; }
  [[nodiscard]] double bottom() const { return area.y + area.height; }
  [[nodiscard]] double inside_y(double value) const {
    return std::clamp(y(value), area.y, bottom());
  }
  [[nodiscard]] bool holds(Point p) const {
    constexpr double slack = 0.01;
    return p.x > area.x - slack && p.x < right() + slack && p.y > area.y - slack &&
           p.y < bottom() + slack;
  }
};

std::vector<double> x_values(const Panel& panel) {
  std::vector<double> out;
  for (const Series& series : panel.series)
    for (const Sample& sample : series.points) out.push_back(sample.x);
  for (const Span& span : panel.spans) out.insert(out.end(), {span.from, span.to});
  for (const Area& area : panel.areas) out.insert(out.end(), {area.x_from, area.x_to});
  return out;
}

std::vector<double> y_values(const Panel& panel) {
  std::vector<double> out;
  for (const Series& series : panel.series)
    for (const Sample& s : series.points) out.insert(out.end(), {s.y, s.low, s.high});
  for (const Area& area : panel.areas) out.insert(out.end(), {area.y_from, area.y_to});
  for (const Limit& limit : panel.limits)
    if (!limit.diagonal) out.push_back(limit.value);
  return out;
}

svg::Range shared_range(const Plot& plot, Axis Panel::*axis,
                        std::vector<double> (*values_of)(const Panel&)) {
  std::vector<double> values;
  for (const Panel& panel : plot.panels)
    for (const double value : values_of(panel)) values.push_back(value);
  return plot.panels.empty() ? svg::Range{} : range_of(plot.panels.front().*axis, values);
}

int y_tick_count(const Plot& plot) {
  return std::max(2, static_cast<int>(plot.panel_height / row_of_ticks));
}

bool is_in_use(const Plot& plot, bool Sample::*flag) {
  return std::ranges::any_of(plot.panels, [&](const Panel& panel) {
    return std::ranges::any_of(panel.series, [&](const Series& series) {
      return std::ranges::any_of(series.points, flag);
    });
  });
}

std::string line_class(const Series& series) {
  const std::string width = series.line == Line::thin     ? "curve thin "
                            : series.line == Line::dashed ? "curve dashed "
                                                          : "curve ";
  return width + mark_class(series.family);
}

Key key_of(const Series& series) {
  return {series.name, [=](Canvas& canvas, Point at) {
            if (series.line != Line::none) canvas.line(at, {at.x + 16, at.y}, line_class(series));
            if (series.marks) draw_mark(canvas, {at.x + 8, at.y}, series.family);
          }};
}

/// Each name once, then the areas and the front.
std::vector<Key> legend_of(const Plot& plot) {
  std::vector<Key> out;
  std::set<std::string> named;
  for (const Panel& panel : plot.panels)
    for (const Series& series : panel.series)
      if (!series.name.empty() && !series.points.empty() && named.insert(series.name).second)
        out.push_back(key_of(series));
  if (!plot.area_name.empty())
    out.push_back({plot.area_name, [](Canvas& canvas, Point at) {
                     canvas.rect({at.x, at.y - 4, 16, 8}, "force-band");
                   }});
  if (!plot.front_name.empty() && is_in_use(plot, &Sample::front))
    out.push_back({plot.front_name, [](Canvas& canvas, Point at) {
                     canvas.diamond({at.x + 8, at.y}, 8, "front-mark");
                   }});
  return out;
}

void draw_y_axis(Sheet& sheet, const Place& place, const Axis& axis, int count, double left) {
  for (const TickLabel& tick : tick_labels(axis, place.y.data, count)) {
    const double y = place.y(tick.at);
    sheet.canvas.line({place.area.x, y}, {place.right(), y}, "grid");
    if (place.y_numbers) sheet.write({place.area.x - 6, y + 4}, tick.text, text::tick, Anchor::end);
  }
  if (place.y_numbers)
    sheet.write_within(place.area.height + 2 * panel_title_row,
                       {left + 12, place.area.y + place.area.height / 2}, axis.title, text::axis,
                       Anchor::middle, true);
}

void draw_ground(Sheet& sheet, const Place& place, const Panel& panel) {
  for (const Span& span : panel.spans) {
    const double x = place.x(span.from);
    sheet.canvas.rect({x, place.area.y, place.x(span.to) - x, place.area.height},
                      "phase phase-" + span.name);
  }
  for (const Area& area : panel.areas) {
    const double x = place.x(area.x_from), y = place.y(area.y_to);
    sheet.canvas.rect({x, y, place.x(area.x_to) - x, place.y(area.y_from) - y},
                      area.bar ? "bar" : "force-band", area.bar ? 0.5 : 1);
  }
}

void name_ground(Sheet& sheet, const Place& place, const Panel& panel) {
  for (const Span& span : panel.spans)
    sheet.write({(place.x(span.from) + place.x(span.to)) / 2, place.area.y - 5}, span.name,
                text::phase, Anchor::middle);
  for (const Area& area : panel.areas)
    sheet.write({(place.x(area.x_from) + place.x(area.x_to)) / 2, place.y(area.y_to) - 4},
                area.label, text::tick, Anchor::middle);
}

void draw_interval(Sheet& sheet, const Place& place, const Sample& sample, std::size_t family) {
  if (!std::isfinite(sample.low) || !std::isfinite(sample.high)) return;
  const double x = place.x(sample.x), low = place.inside_y(sample.low),
               high = place.inside_y(sample.high);
  const std::string css_class = "whisker " + mark_class(family);
  sheet.canvas.line({x, low}, {x, high}, css_class);
  sheet.canvas.line({x - 3, low}, {x + 3, low}, css_class);
  sheet.canvas.line({x - 3, high}, {x + 3, high}, css_class);
  sheet.reserve({x - 3, high, 6, low - high});
}

void draw_series(Sheet& sheet, const Place& place, const Series& series) {
  std::vector<Point> points;
  for (const Sample& sample : series.points) {
    const Point at = place.at(sample.x, sample.y);
    points.push_back(place.holds(at) ? at : Point{no_number, no_number});
  }
  if (series.line != Line::none) sheet.canvas.polyline(points, line_class(series));
  if (!series.marks) return;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!place.holds(points[i])) continue;
    draw_interval(sheet, place, series.points[i], series.family);
    draw_mark(sheet.canvas, points[i], series.family);
    const double radius = series.points[i].front ? front_radius : 6;
    sheet.reserve({points[i].x - radius, points[i].y - radius, 2 * radius, 2 * radius});
  }
}

/// Draws the staircase of the best values up to each x, and a diamond for each front point.
void draw_front(Sheet& sheet, const Place& place, const Panel& panel) {
  std::vector<Point> front;
  for (const Series& series : panel.series)
    for (const Sample& sample : series.points)
      if (const Point at = place.at(sample.x, sample.y); sample.front && place.holds(at))
        front.push_back(at);
  std::ranges::stable_sort(front, {}, &Point::x);
  std::vector<Point> stairs;
  for (const Point& at : front) {
    if (!stairs.empty()) stairs.push_back({at.x, stairs.back().y});
    stairs.push_back(at);
    sheet.canvas.diamond(at, front_radius, "front-mark");
  }
  sheet.canvas.polyline(stairs, "front-line");
  for (std::size_t k = 1; k < stairs.size(); ++k) {
    const Point a = stairs[k - 1], b = stairs[k];
    sheet.reserve({std::min(a.x, b.x) - 1, std::min(a.y, b.y) - 1, std::abs(a.x - b.x) + 2,
                   std::abs(a.y - b.y) + 2});
  }
}

void label_samples(Sheet& sheet, const Place& place, const Panel& panel) {
  for (const Series& series : panel.series)
    for (const Sample& sample : series.points) {
      const Point at = place.at(sample.x, sample.y);
      if (sample.label.empty() || !place.holds(at)) continue;
      const std::string shown = svg::shorten_end(sample.label, place.area.width / 2, text::point);
      const double left = at.x - svg::text_width(shown, text::point) - front_radius - 2,
                   right = at.x + front_radius + 3;
      std::vector<Point> corners;
      for (double shift = 0; shift < 6 * label_height; shift += label_height)
        for (const Point& corner : {Point{left, at.y - 18 - shift}, Point{right, at.y + 4 + shift},
                                    Point{right, at.y - 18 - shift}, Point{left, at.y + 4 + shift}})
          if (corner.y > place.area.y && corner.y + label_height < place.bottom() &&
              corner.x > place.area.x)
            corners.push_back(corner);
      sheet.write_at_first(corners, shown, text::point);
    }
}

/// Puts the label above or below the line, starting at the right end, if there is room.
void draw_limits(Sheet& sheet, const Place& place, const Panel& panel) {
  for (const Limit& limit : panel.limits) {
    if (limit.diagonal) {
      sheet.canvas.line({place.area.x, place.bottom()}, {place.right(), place.area.y}, "limit");
      continue;
    }
    const double y = place.inside_y(limit.value);
    sheet.canvas.line({place.area.x, y}, {place.right(), y}, "level-line");
    const std::string shown = svg::shorten_end(limit.label, place.area.width - 8, text::level);
    std::vector<Point> corners;
    for (double x = place.right() - 4 - svg::text_width(shown, text::level); x > place.area.x;
         x -= 12)
      corners.insert(corners.end(), {{x, y - label_height - 1}, {x, y + 1}});
    sheet.write_at_first(corners, shown, text::level);
  }
}

void draw_panel(Sheet& sheet, const Place& place, const Panel& panel, int count, double left) {
  const bool has_names =
      std::ranges::any_of(panel.spans, [](const Span& span) { return !span.name.empty(); });
  sheet.write_within(place.area.width,
                     {place.area.x, place.area.y - (has_names ? span_row : 0) - 6}, panel.title,
                     text::panel);
  draw_ground(sheet, place, panel);
  draw_x_axis(sheet, place.area, place.x, panel.x, place.x_numbers);
  draw_y_axis(sheet, place, panel.y, count, left);
  for (const Series& series : panel.series) draw_series(sheet, place, series);
  draw_front(sheet, place, panel);
  draw_limits(sheet, place, panel);
  name_ground(sheet, place, panel);
  label_samples(sheet, place, panel);
}

/// Sizes that all panels share.
struct Layout {
  std::size_t columns, rows;
  double top, left, title, below, width, height;
  svg::Range x, y;  ///< ranges, if shared
};

bool has_title(const Plot& plot, std::string Axis::*title, Axis Panel::*axis) {
  return std::ranges::any_of(plot.panels,
                             [&](const Panel& p) { return !(p.*axis.*title).empty(); });
}

double number_column(const Plot& plot, const Layout& layout) {
  double out = 0;
  for (const Panel& panel : plot.panels) {
    const svg::Range range = plot.shared_y ? layout.y : range_of(panel.y, y_values(panel));
    for (const TickLabel& tick : tick_labels(panel.y, range, y_tick_count(plot)))
      out = std::max(out, svg::text_width(tick.text, text::tick));
  }
  return out + 9;
}

Layout layout_of(const Plot& plot, const std::vector<Key>& keys) {
  Layout out{};
  out.columns = std::max<std::size_t>(1, std::min(plot.columns, plot.panels.size()));
  out.rows = (plot.panels.size() + out.columns - 1) / out.columns;
  if (plot.shared_x) out.x = shared_range(plot, &Panel::x, x_values);
  if (plot.shared_y) out.y = shared_range(plot, &Panel::y, y_values);
  out.top = legend_height(keys, plot.width);
  out.left =
      number_column(plot, out) + (has_title(plot, &Axis::title, &Panel::y) ? axis_title_column : 0);
  const auto columns = static_cast<double>(out.columns);
  const double lefts = plot.shared_y ? out.left + (columns - 1) * panel_gap : columns * out.left;
  out.width = (plot.width - lefts - columns * panel_edge) / columns;
  for (const Panel& panel : plot.panels) {
    const double spans = panel.spans.empty() ? 0 : span_row;
    out.title = std::max(out.title, (panel.title.empty() ? 8 : panel_title_row + 3) + spans);
    out.below = std::max(out.below, x_axis_height(panel.x, out.width));
  }
  out.height = out.title + plot.panel_height + out.below;
  return out;
}

Place place_of(const Plot& plot, const Layout& layout, std::size_t i) {
  const std::size_t column = i % layout.columns, row = i / layout.columns;
  const Panel& panel = plot.panels[i];
  Place out;
  out.y_numbers = !plot.shared_y || column == 0;
  out.x_numbers = !plot.shared_x || i + layout.columns >= plot.panels.size();
  const double step = layout.width + panel_edge + (plot.shared_y ? panel_gap : layout.left);
  // Upper panels with a shared x have no numbers below.
  const double row_height = plot.shared_x ? layout.title + plot.panel_height + 6 : layout.height;
  out.area = {layout.left + static_cast<double>(column) * step,
              layout.top + static_cast<double>(row) * row_height + layout.title, layout.width,
              plot.panel_height};
  const svg::Range x = plot.shared_x ? layout.x : range_of(panel.x, x_values(panel));
  const svg::Range y = plot.shared_y ? layout.y : range_of(panel.y, y_values(panel));
  out.x = {x, out.area.x, out.right(), panel.x.logarithmic};
  out.y = {y, out.bottom(), out.area.y, panel.y.logarithmic};
  return out;
}

double height_of(const Plot& plot, const Layout& layout) {
  const double upper = plot.shared_x ? layout.title + plot.panel_height + 6 : layout.height;
  // In an incomplete last row, the numbers of the row above it also need their room.
  const bool is_ragged = plot.shared_x && plot.panels.size() % layout.columns != 0;
  return layout.top + upper * static_cast<double>(layout.rows - 1) +
         std::max(layout.height, is_ragged ? layout.below : 0) + (plot.stamp.empty() ? 2 : 18);
}

}  // namespace

std::vector<Series> series_of(const std::vector<std::string>& families,
                              const std::vector<FamilySample>& points) {
  std::vector<Series> out;
  for (std::size_t f = 0; f < families.size(); ++f) {
    Series series{families[f], f};
    for (const FamilySample& one : points)
      if (one.family == f) series.points.push_back(one.sample);
    if (!series.points.empty()) out.push_back(std::move(series));
  }
  return out;
}

Axis percent_axis(std::string title, const std::vector<FamilySample>& points) {
  double low = 100, high = 0;
  for (const FamilySample& one : points)
    for (const double value : {one.sample.y, one.sample.low, one.sample.high})
      if (std::isfinite(value)) {
        low = std::min(low, value);
        high = std::max(high, value);
      }
  low = std::max(0.0, std::floor(low / 5 - 0.1) * 5);
  high = std::max(std::min(100.0, std::ceil(high / 5 + 0.1) * 5), low + 5);
  return {.title = std::move(title), .low = low, .high = high + 0.06 * (high - low)};
}

std::string draw(const Plot& plot) {
  if (plot.panels.empty()) return {};
  const std::vector<Key> keys = legend_of(plot);
  const Layout layout = layout_of(plot, keys);
  const double height = height_of(plot, layout);
  Sheet sheet(plot.width, height, plot.words, plot.width < 600 ? "plot narrow" : "plot");
  draw_legend(sheet, keys, 2, plot.width - 4);
  sheet.write_within(plot.width, {plot.width - 4, height - 5}, plot.stamp, text::stamp,
                     Anchor::end);
  for (std::size_t i = 0; i < plot.panels.size(); ++i) {
    const Place place = place_of(plot, layout, i);
    draw_panel(sheet, place, plot.panels[i], y_tick_count(plot), place.area.x - layout.left);
  }
  return sheet.canvas.finish();
}

}  // namespace weft::daemon::chart
