#include "daemon/pages/plot/html.hpp"

#include <cmath>
#include <vector>

#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/scatter.hpp"

namespace weft::daemon {
namespace {

std::string cell(std::string_view tag, std::string_view html, std::string_view css_class) {
  std::string out = "<" + std::string(tag);
  if (!css_class.empty()) out += " class=\"" + std::string(css_class) + "\"";
  return out + ">" + std::string(html) + "</" + std::string(tag) + ">";
}

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

HtmlTable::HtmlTable(std::vector<std::string> head_html, std::size_t figures_from)
    : figures_from_(figures_from), out_("<div class=\"scroll\"><table>\n<thead><tr>") {
  for (std::size_t i = 0; i < head_html.size(); ++i)
    out_ += cell("th", head_html[i], i >= figures_from_ ? "number" : "");
  out_ += "</tr></thead>\n<tbody>\n";
}

void HtmlTable::row(const std::vector<std::string>& cells_html, std::string_view css_class) {
  out_ += css_class.empty() ? "<tr>" : "<tr class=\"" + std::string(css_class) + "\">";
  for (std::size_t i = 0; i < cells_html.size(); ++i)
    out_ += cell(i == 0 ? "th" : "td", cells_html[i], i >= figures_from_ ? "number" : "");
  out_ += "</tr>\n";
}

std::string HtmlTable::finish() const {
  return out_ + "</tbody></table></div>\n";
}

std::string figure(std::string_view body_html, std::string_view caption_html,
                   std::string_view badge_html, std::string_view css_class) {
  std::string out = "<figure";
  if (!css_class.empty()) out += " class=\"" + std::string(css_class) + "\"";
  return out + ">\n" + std::string(body_html) + "<figcaption>" + std::string(badge_html) + " " +
         std::string(caption_html) + "</figcaption>\n</figure>\n";
}

std::string feature_html(std::string_view name) {
  const std::size_t first = name.find('.');
  if (first == std::string_view::npos) return escape(name);
  const std::size_t second = name.find('.', first + 1);
  const std::string_view phase = name.substr(first + 1, second - first - 1);
  std::string index(name.substr(0, first));
  if (second != std::string_view::npos) index += name.substr(second);
  return "<span class=\"feature\"><i>F</i><sup>" + escape(phase) + "</sup><sub>" + escape(index) +
         "</sub></span>";
}

std::string bench_badge(BenchKind kind) {
  return "<span class=\"badge\">" + std::string(bench_text(kind)) + "</span>";
}

std::string definition(std::string_view name, std::string_view value) {
  return "<dt>" + escape(name) + "</dt><dd>" +
         (value.empty() ? std::string(no_value) : escape(value)) + "</dd>\n";
}

std::string page_around(std::string_view title, std::string_view main_html) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>" +
         escape(title) + "</title>\n<style>" + std::string(style_sheet()) +
         std::string(marks_style()) + std::string(scatter_style()) +
         "</style>\n</head>\n<body>\n<main>\n" + std::string(main_html) +
         "</main>\n</body>\n</html>\n";
}

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
