#include "daemon/pages/plot/marks.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/base/text/format.hpp"

namespace weft::daemon::chart {
namespace {

using svg::Anchor;
using svg::Canvas;
using svg::Point;

constexpr double mark_radius = 4.5, quarter = 1.5707963267948966;
constexpr double key_height = 18, key_text_x = 21, key_gap = 18, tick_row = 17, title_row = 19;
constexpr double longest_name = 110;

void polygon(Canvas& canvas, Point at, double radius, int corners, double turn_rad,
             const std::string& css_class) {
  std::vector<Point> points;
  for (int k = 0; k <= corners; ++k) {
    const double angle = turn_rad + 4 * quarter * k / corners;
    points.push_back({at.x + radius * std::cos(angle), at.y + radius * std::sin(angle)});
  }
  canvas.polyline(points, css_class);
}

void cross(Canvas& canvas, Point at, double x, double y, const std::string& css_class) {
  canvas.line({at.x - x, at.y - y}, {at.x + x, at.y + y}, css_class);
  canvas.line({at.x - y, at.y + x}, {at.x + y, at.y - x}, css_class);
}

double key_width(const Key& key, double width) {
  return std::min(key_text_x + svg::text_width(key.words, svg::text::key) + key_gap, width);
}

/// Left ends of the legend's entries, in rows.
std::vector<Point> key_places(const std::vector<Key>& keys, double left, double width) {
  std::vector<Point> out;
  double x = 0, y = 0;
  for (const Key& key : keys) {
    if (x > 0 && x + key_width(key, width) > width) {
      x = 0;
      y += key_height;
    }
    out.push_back({left + x, y});
    x += key_width(key, width);
  }
  return out;
}

std::string number_text(const Axis& axis, double value) {
  return axis.seconds ? tick_text(value) : general(value);
}

bool are_names_turned(const Axis& axis, double width) {
  return svg::widest(axis.names, svg::text::tick) + 6 >
         width / static_cast<double>(std::max<std::size_t>(1, axis.names.size()));
}

/// Draws names below their places, or turned if they are too wide.
void draw_names(svg::Sheet& sheet, const svg::Box& area, const svg::Scale& scale,
                const Axis& axis) {
  const double bottom = area.y + area.height;
  const bool turned = are_names_turned(axis, area.width);
  const auto shown =
      svg::shorten_labels(axis.names, turned ? longest_name : area.width, svg::text::tick);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const double x = scale(static_cast<double>(i));
    sheet.write(turned ? Point{x + 4, bottom + 6} : Point{x, bottom + 14}, shown[i],
                svg::text::tick, turned ? Anchor::end : Anchor::middle, turned, axis.names[i]);
  }
}

}  // namespace

std::string mark_class(std::size_t family) {
  return "family-" + std::to_string(family % family_count);
}

void draw_mark(Canvas& canvas, Point at, std::size_t family) {
  const std::string css_class = mark_class(family);
  switch (family % family_count) {
    case 0:
      return canvas.circle(at, mark_radius + 1, css_class);
    case 1:
      return canvas.circle(at, mark_radius - 1, css_class);
    case 2:
      return polygon(canvas, at, mark_radius, 4, quarter / 2, css_class);
    case 3:
      return polygon(canvas, at, mark_radius, 3, -quarter, css_class);
    case 4:
      return polygon(canvas, at, mark_radius, 3, quarter, css_class);
    case 5:
      return cross(canvas, at, mark_radius - 1, mark_radius - 1, css_class);
    default:
      return cross(canvas, at, mark_radius, 0, css_class);
  }
}

double legend_height(const std::vector<Key>& keys, double width) {
  return keys.empty() ? 0 : key_places(keys, 0, width).back().y + key_height + 4;
}

void draw_legend(svg::Sheet& sheet, const std::vector<Key>& keys, double left, double width) {
  const std::vector<Point> places = key_places(keys, left, width);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const double x = places[i].x, y = places[i].y;
    keys[i].mark(sheet.canvas, {x, y + 10});
    sheet.write_within(width - key_text_x, {x + key_text_x, y + 14}, keys[i].words, svg::text::key);
  }
}

std::vector<TickLabel> tick_labels(const Axis& axis, const svg::Range& range, int count) {
  std::vector<TickLabel> out;
  if (axis.logarithmic) {
    for (const double value : svg::log_ticks(range))
      out.push_back({value, number_text(axis, value)});
    return out;
  }
  const svg::Ticks marks = svg::ticks(range, count);
  for (const double value : marks.at)
    out.push_back({value, axis.seconds ? tick_text(value) : fixed(value, marks.decimals)});
  return out;
}

svg::Range range_of(const Axis& axis, const std::vector<double>& values) {
  if (!axis.names.empty()) return {-0.5, static_cast<double>(axis.names.size()) - 0.5};
  svg::Range out = axis.logarithmic ? svg::log_range_of(values, 0.08) : svg::find_range(values);
  if (std::isfinite(axis.low)) out.low = axis.low;
  if (std::isfinite(axis.high)) out.high = axis.high;
  if (!(out.high > out.low)) out.high = axis.logarithmic ? out.low * 2 : out.low + 1;
  return out;
}

double x_axis_height(const Axis& axis, double width, bool numbers) {
  double out = 4;
  if (numbers && !axis.names.empty() && are_names_turned(axis, width))
    out += std::min(longest_name, svg::widest(axis.names, svg::text::tick)) + 6;
  else if (numbers)
    out += tick_row;
  return out + (numbers && !axis.title.empty() ? title_row : 0);
}

void draw_x_axis(svg::Sheet& sheet, const svg::Box& area, const svg::Scale& scale, const Axis& axis,
                 bool numbers) {
  const double bottom = area.y + area.height;
  sheet.canvas.line({area.x, bottom}, {area.x + area.width, bottom}, "axis");
  if (!axis.names.empty()) {
    if (numbers) draw_names(sheet, area, scale, axis);
  } else {
    const int count = std::max(2, static_cast<int>(area.width / 70));
    for (const TickLabel& tick : tick_labels(axis, scale.data, count)) {
      sheet.canvas.line({scale(tick.at), area.y}, {scale(tick.at), bottom}, "grid");
      if (numbers)
        sheet.write({scale(tick.at), bottom + 14}, tick.text, svg::text::tick, Anchor::middle);
    }
  }
  if (numbers)
    sheet.write_within(area.width,
                       {area.x + area.width / 2, bottom + x_axis_height(axis, area.width) - 7},
                       axis.title, svg::text::axis, Anchor::middle);
}

}  // namespace weft::daemon::chart
