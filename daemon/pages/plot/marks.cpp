#include "daemon/pages/plot/marks.hpp"

#include <cmath>
#include <vector>

namespace weft::daemon {
namespace {

using svg::Canvas;
using svg::Point;

constexpr double mark_radius = 4.5;

// Okabe and Ito 2008 without yellow; shapes tell the families apart as well.
constexpr std::string_view sheet = R"css(
:root{--family-0:#1d2327;--family-1:#0072b2;--family-2:#d55e00;--family-3:#00795c;--family-4:#a3487f;--family-5:#7a5c00;--family-6:#5a646b}
@media (prefers-color-scheme:dark){:root{--family-0:#e7e9ea;--family-1:#62b4ec;--family-2:#f5924a;--family-3:#3fc79c;--family-4:#e08fc0;--family-5:#e3c15a;--family-6:#a3adb3}}
.family-0{fill:var(--family-0);stroke:var(--family-0)}.family-1{fill:var(--family-1);stroke:var(--family-1)}
.family-2{fill:var(--family-2);stroke:var(--family-2)}.family-3{fill:var(--family-3);stroke:var(--family-3)}
.family-4{fill:var(--family-4);stroke:var(--family-4)}.family-5{fill:none;stroke:var(--family-5);stroke-width:2.2}
.family-6{fill:none;stroke:var(--family-6);stroke-width:2.2}
.whisker{stroke-width:1;stroke-opacity:.45}
)css";

void polygon(Canvas& canvas, Point at, double radius, int corners, double turn_rad,
             const std::string& css_class) {
  std::vector<Point> points;
  for (int k = 0; k <= corners; ++k) {
    const double angle = turn_rad + 6.283185307179586 * k / corners;
    points.push_back({at.x + radius * std::cos(angle), at.y + radius * std::sin(angle)});
  }
  canvas.polyline(points, css_class);
}

void cross(Canvas& canvas, Point at, double x, double y, const std::string& css_class) {
  canvas.line({at.x - x, at.y - y}, {at.x + x, at.y + y}, css_class);
  canvas.line({at.x - y, at.y + x}, {at.x + y, at.y - x}, css_class);
}

}  // namespace

std::string mark_class(std::size_t family) {
  return "family-" + std::to_string(family % mark_kinds);
}

void draw_mark(Canvas& canvas, Point at, std::size_t family) {
  constexpr double quarter = 1.5707963267948966;
  const std::string css_class = mark_class(family);
  switch (family % mark_kinds) {
    case 0:
      return canvas.circle(at, mark_radius + 1.5, css_class);
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

std::string_view marks_style() {
  return sheet;
}

}  // namespace weft::daemon
