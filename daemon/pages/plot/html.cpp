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

// Blue and orange (Okabe and Ito 2008) stay apart for colour-blind readers; nothing is told by
// colour alone. Dark values are lighter, not inverted.
constexpr std::string_view page_sheet = R"css(
:root{color-scheme:light dark;--page:#f6f5f1;--card:#ffffff;--ink:#1d2327;--soft:#5a646b;--rule:#dcd9d0;
--grid:#e4e2da;--blue:#0b66a8;--orange:#c8500a;--on:#ffffff;--green:#00795c;--pink:#a3487f;--badge:#ffe9b8;
--badge-ink:#6b4300;--phase-S:#8a8f94;--phase-P:#d79a1e;--phase-M:#3a8ec4;--phase-E:#8a8f94;--phase-shade:.13}
@media (prefers-color-scheme:dark){:root{--page:#15191c;--card:#1e2428;--ink:#e7e9ea;--soft:#a3adb3;
--rule:#353d42;--grid:#2f373c;--blue:#62b4ec;--orange:#f5924a;--on:#10161a;--green:#3fc79c;--pink:#e08fc0;
--badge:#4a3a12;--badge-ink:#ffd98a;--phase-shade:.17}}
*{box-sizing:border-box}
body{margin:0;background:var(--page);color:var(--ink);font:16px/1.55 system-ui,-apple-system,"Segoe UI",
Roboto,"Liberation Sans","DejaVu Sans",sans-serif;font-variant-numeric:tabular-nums}
main{max-width:1120px;margin:0 auto;padding:28px 20px 60px}
h1{font-size:1.9rem;line-height:1.2;margin:.5rem 0 .3rem;letter-spacing:-.01em}
h2{font-size:1.3rem;margin:2.6rem 0 .5rem;line-height:1.3}
p{margin:.5rem 0 .8rem;max-width:56rem}
.lead{font-size:1.05rem;color:var(--soft)}
.badge{display:inline-block;background:var(--badge);color:var(--badge-ink);font-size:.68rem;font-weight:700;
letter-spacing:.08em;padding:.1rem .45rem;border-radius:3px;vertical-align:.08em;white-space:nowrap}
header .badge{font-size:.85rem;padding:.25rem .7rem}
.note{border-left:4px solid var(--badge-ink);background:var(--card);padding:.7rem 1rem;margin:1.1rem 0;max-width:none}
.note p{max-width:none;margin:.25rem 0}
.alarm{border-color:var(--orange)}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(144px,1fr));gap:10px;margin:1.2rem 0}
.tile{background:var(--card);border:1px solid var(--rule);border-radius:8px;padding:.7rem .9rem}
.tile b{display:block;font-size:1.2rem;line-height:1.25;font-weight:650;overflow-wrap:anywhere}
.tile span{color:var(--soft);font-size:.84rem;line-height:1.35;display:block}
figure{margin:1rem 0;background:var(--card);border:1px solid var(--rule);border-radius:8px;padding:14px 16px}
figcaption{color:var(--soft);font-size:.88rem;line-height:1.45;margin-top:.6rem;max-width:56rem}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,440px),1fr));gap:0 16px}
.pads{display:grid;grid-template-columns:repeat(4,1fr);gap:6px}
.scroll{overflow-x:auto}
svg{display:block;width:100%;height:auto;font-family:inherit}
svg text{fill:var(--ink);font-size:12px}
svg .tick,svg .key{fill:var(--soft);font-size:11.5px}
svg .axis-title{fill:var(--soft);font-size:12px}
svg .row-name{font-size:13px}
svg .phase-name,svg .pad-name{font-weight:700;font-size:12px}
svg.small .phase-name{font-size:9px;font-weight:400;fill:var(--soft)}
svg.small .tick,svg.small .axis-title{font-size:9.5px}
.narrow{max-width:760px;margin:0 auto}
.grid{stroke:var(--grid);stroke-width:1}.axis{stroke:var(--soft);stroke-width:1}
.curve{fill:none;stroke-width:1.5;stroke-linejoin:round}.thin{stroke-width:1.1}
.first{stroke:var(--blue)}.second{stroke:var(--orange)}
.key-first{fill:var(--blue)}.key-second{fill:var(--orange)}
.phase{fill-opacity:var(--phase-shade)}.phase-S{fill:var(--phase-S)}.phase-P{fill:var(--phase-P)}
.phase-M{fill:var(--phase-M)}.phase-E{fill:var(--phase-E)}
.force-band{fill:var(--green);fill-opacity:.35}
.cell-hit{fill:var(--blue)}.cell-miss{fill:var(--orange)}.cell-empty{fill:var(--grid);fill-opacity:.45}
.cell-diagonal{fill:var(--grid)}
svg .cell-text{font-size:10px}svg .cell-text.on{fill:var(--on)}
.interval{stroke:var(--blue);stroke-width:2}.mark{fill:var(--blue)}
.paper-mark{fill:var(--card);stroke:var(--orange);stroke-width:2}
.bar{fill:var(--blue)}.worst-mark{fill:var(--card);stroke:var(--pink);stroke-width:2}
.limit{stroke:var(--green);stroke-width:2;stroke-dasharray:5 4}
.share-1{fill:var(--blue)}.share-2{fill:var(--orange)}.share-3{fill:var(--green)}.share-4{fill:var(--soft)}
svg .share-text{fill:var(--on);font-size:13px;font-weight:600}
i.swatch{display:inline-block;width:.75em;height:.75em;border-radius:2px;margin-right:.45em}
.swatch.share-1{background:var(--blue)}.swatch.share-2{background:var(--orange)}
.swatch.share-3{background:var(--green)}.swatch.share-4{background:var(--soft)}
table{border-collapse:collapse;width:100%;font-size:.92rem}
th,td{padding:.35rem .6rem;text-align:left;border-bottom:1px solid var(--rule);vertical-align:top}
thead th{color:var(--soft);font-weight:600;font-size:.84rem;line-height:1.3;vertical-align:bottom}
tbody th{font-weight:500;white-space:nowrap}
.number{text-align:right}td.number{white-space:nowrap}
.paper{color:var(--orange)}.dim{color:var(--soft)}
.interval-text{display:block;color:var(--soft);font-size:.84em}
.feature{white-space:nowrap;margin-right:.5em}sub,sup{font-size:.72em;line-height:0}
dl{display:grid;grid-template-columns:max-content 1fr;gap:.2rem 1rem;margin:0;font-size:.92rem}
dt{color:var(--soft)}dd{margin:0;overflow-wrap:anywhere}
code,pre{font-family:ui-monospace,"DejaVu Sans Mono",Menlo,Consolas,monospace;font-size:.86em}
pre{overflow-x:auto;background:var(--page);padding:.7rem;border-radius:6px;line-height:1.4}
details{margin-top:.7rem}summary{cursor:pointer;color:var(--soft)}
@media (max-width:680px){main{padding:16px 12px 40px}h1{font-size:1.5rem}.pads{grid-template-columns:repeat(2,1fr)}
.tiles{grid-template-columns:repeat(2,1fr)}.scroll>svg.plot{min-width:600px}.scroll>svg.narrow{min-width:0}.scroll>svg.heat{min-width:480px}
figure{padding:10px}dl{grid-template-columns:1fr;gap:0}dd{margin-bottom:.45rem}}
@media print{:root{color-scheme:light;--page:#fff;--card:#fff;--ink:#1d2327;--soft:#5a646b;--rule:#dcd9d0;--grid:#e4e2da;
--blue:#0b66a8;--orange:#c8500a;--on:#fff;--green:#00795c;--pink:#a3487f;--badge:#ffe9b8;--badge-ink:#6b4300}
body{font-size:10pt;background:none}figure,.tile,tr{break-inside:avoid}h2,thead{break-after:avoid}
.tiles{grid-template-columns:repeat(4,1fr)}.pair{grid-template-columns:1fr 1fr}table{font-size:8.5pt}details>*{display:block}
main{max-width:none;padding:0}.scroll{overflow:visible}*{print-color-adjust:exact;-webkit-print-color-adjust:exact}}
)css";

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

std::string standalone_svg(std::string_view svg) {
  const std::size_t inside = svg.find('>') + 1;
  return std::string(svg.substr(0, inside)) + "\n<style><![CDATA[" + std::string(style_sheet()) +
         std::string(marks_style()) +
         "svg{background:var(--card);font-family:system-ui,sans-serif}svg "
         ".key{font-size:10px}]]></style>\n" +
         std::string(svg.substr(inside));
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

std::string_view style_sheet() {
  return page_sheet;
}

std::string_view marks_style() {
  return sheet;
}

}  // namespace weft::daemon
