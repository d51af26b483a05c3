#include "daemon/pages/plot/style.hpp"

#include "daemon/pages/plot/text_layout.hpp"

namespace weft::daemon {
namespace {

// Blue and orange (Okabe and Ito 2008) are distinct for colour-blind readers; no information
// depends on colour alone. Dark values are lighter, not inverted. Families of marks also differ by
// shape.
constexpr std::string_view sheet = R"css(
:root,:host{color-scheme:light dark;--page:#f6f5f1;--card:#ffffff;--ink:#1d2327;--soft:#5a646b;--rule:#dcd9d0;
--grid:#e4e2da;--blue:#0b66a8;--orange:#c8500a;--on:#ffffff;--green:#00795c;--pink:#a3487f;--badge:#ffe9b8;
--badge-ink:#6b4300;--phase-S:#8a8f94;--phase-P:#d79a1e;--phase-M:#3a8ec4;--phase-E:#8a8f94;--phase-shade:.13}
@media (prefers-color-scheme:dark){:root,:host{--page:#15191c;--card:#1e2428;--ink:#e7e9ea;--soft:#a3adb3;
--rule:#353d42;--grid:#2f373c;--blue:#62b4ec;--orange:#f5924a;--on:#10161a;--green:#3fc79c;--pink:#e08fc0;
--badge:#4a3a12;--badge-ink:#ffd98a;--phase-shade:.17}}
body{margin:0}.weft-page,.weft-page *{box-sizing:border-box}
.weft-page{background:var(--page);color:var(--ink);font:16px/1.5 system-ui,-apple-system,"Segoe UI",
Roboto,"Liberation Sans","DejaVu Sans",sans-serif;font-variant-numeric:tabular-nums;min-height:100vh;
padding:24px max(20px,calc((100% - 1080px)/2)) 60px}
h1{font-size:1.9rem;line-height:1.2;margin:.5rem 0 .3rem;letter-spacing:-.01em}
h2{font-size:1.3rem;margin:1.7rem 0 .4rem;line-height:1.3}
p{margin:.5rem 0 .8rem;max-width:56rem}h1,h2,p,li,figcaption,summary{overflow-wrap:anywhere}
.lead{font-size:1.05rem;color:var(--soft)}
.badge{display:inline-block;background:var(--badge);color:var(--badge-ink);font-size:.68rem;font-weight:700;
letter-spacing:.08em;padding:.1rem .45rem;border-radius:3px;vertical-align:.08em;white-space:nowrap}
header .badge{font-size:.85rem;padding:.25rem .7rem}
.note{border-left:4px solid var(--badge-ink);background:var(--card);padding:.35rem .9rem;margin:.5rem 0;max-width:none}
.note p{max-width:none;margin:.25rem 0}
.alarm{border-color:var(--orange)}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(144px,1fr));gap:10px;margin:.8rem 0}
.tile{background:var(--card);border:1px solid var(--rule);border-radius:8px;padding:.7rem .9rem}
.tile b{display:block;font-size:1.2rem;line-height:1.25;font-weight:650;overflow-wrap:anywhere}
.tile span{color:var(--soft);font-size:.84rem;line-height:1.35;display:block}
figure{margin:.7rem 0;background:var(--card);border:1px solid var(--rule);border-radius:8px;padding:14px 16px}
figcaption{color:var(--soft);font-size:.88rem;line-height:1.45;margin-top:.6rem;max-width:56rem}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,440px),1fr));gap:0 16px}.pair>*{min-width:0}
.scroll{overflow-x:auto}
svg{display:block;font-family:inherit}svg:not(.heat){width:100%;height:auto}
svg text{fill:var(--ink)}svg .tick,svg .key,svg .axis-title{fill:var(--soft)}
svg .stamp{fill:var(--badge-ink)}svg .level-name{fill:var(--badge-ink)}
.narrow{max-width:760px;margin:0 auto}
.grid{stroke:var(--grid);stroke-width:1}.axis{stroke:var(--soft);stroke-width:1}
.phase{fill-opacity:var(--phase-shade)}.phase-S{fill:var(--phase-S)}.phase-P{fill:var(--phase-P)}
.phase-M{fill:var(--phase-M)}.phase-E{fill:var(--phase-E)}
.force-band{fill:var(--green);fill-opacity:.35}
.cell-hit{fill:var(--blue)}.cell-miss{fill:var(--orange)}.cell-empty{fill:var(--grid);fill-opacity:.45}
svg .cell-text.on{fill:var(--on)}
.interval{stroke:var(--blue);stroke-width:2}.mark{fill:var(--blue)}
.paper-mark{fill:var(--card);stroke:var(--orange);stroke-width:2}
.bar{fill:var(--blue)}.worst-mark{fill:var(--card);stroke:var(--pink);stroke-width:2}
.limit{stroke:var(--green);stroke-width:2;stroke-dasharray:5 4}
.share-1{fill:var(--blue)}.share-2{fill:var(--orange)}.share-3{fill:var(--green)}.share-4{fill:var(--soft)}
svg .share-text{fill:var(--on)}
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
details{margin:.5rem 0}summary{cursor:pointer;color:var(--soft)}summary h2{display:inline;color:var(--ink)}ul{margin:.4rem 0;padding-left:1.3rem}
:root,:host{--family-0:#1d2327;--family-1:#0072b2;--family-2:#d55e00;--family-3:#00795c;--family-4:#a3487f;--family-5:#7a5c00;--family-6:#5a646b}
@media (prefers-color-scheme:dark){:root,:host{--family-0:#e7e9ea;--family-1:#62b4ec;--family-2:#f5924a;--family-3:#3fc79c;--family-4:#e08fc0;--family-5:#e3c15a;--family-6:#a3adb3}}
.family-0{fill:var(--family-0);stroke:var(--family-0)}.family-1{fill:var(--family-1);stroke:var(--family-1)}
.family-2{fill:var(--family-2);stroke:var(--family-2)}.family-3{fill:var(--family-3);stroke:var(--family-3)}
.family-4{fill:var(--family-4);stroke:var(--family-4)}.family-5{fill:none;stroke:var(--family-5);stroke-width:2.2}
.family-6{fill:none;stroke:var(--family-6);stroke-width:2.2}
.whisker{stroke-width:1;stroke-opacity:.45}
.curve{fill:none;stroke-width:1.6;stroke-linejoin:round}.thin{stroke-width:1.1}.dashed{stroke-dasharray:5 4}
.front-mark{fill:none;stroke:var(--ink);stroke-width:1.6}
.front-line{fill:none;stroke:var(--ink);stroke-width:1.4;stroke-dasharray:5 4}
.level-line{stroke:var(--badge-ink);stroke-width:1.3;stroke-dasharray:2 3}
.map-ground{fill:var(--page);stroke:var(--rule)}.map-level{fill:var(--blue)}
.on-front th,.on-front td{font-weight:650}
@media (max-width:680px){.weft-page{padding:16px 12px 40px}h1{font-size:1.5rem}
.tiles{grid-template-columns:repeat(2,1fr)}.scroll>svg.plot{min-width:600px}.scroll>svg.narrow{min-width:0}
figure{padding:10px}dl{grid-template-columns:1fr;gap:0}dd{margin-bottom:.45rem}}
@media print{:root,:host{color-scheme:light;--page:#fff;--card:#fff;--ink:#1d2327;--soft:#5a646b;--rule:#dcd9d0;--grid:#e4e2da;
--blue:#0b66a8;--orange:#c8500a;--on:#fff;--green:#00795c;--pink:#a3487f;--badge:#ffe9b8;--badge-ink:#6b4300;--family-0:#1d2327;--family-1:#0072b2;--family-2:#d55e00;
--family-3:#00795c;--family-4:#a3487f;--family-5:#7a5c00;--family-6:#5a646b}
.weft-page{font-size:10pt;background:none;max-width:none;padding:0}figure,.tile,tr{break-inside:avoid}h2,thead,summary{break-after:avoid}
svg{max-width:100%;height:auto}
.tiles{grid-template-columns:repeat(4,1fr)}.pair{grid-template-columns:1fr 1fr}table{font-size:8.5pt}details>*{display:block}details::details-content{content-visibility:visible;block-size:auto}
.scroll{overflow:visible}*{print-color-adjust:exact;-webkit-print-color-adjust:exact}}
)css";

}  // namespace

std::string style_sheet() {
  return std::string(sheet) + svg::text_style_sheet();
}

std::string standalone_svg(std::string_view svg) {
  const std::size_t inside = svg.find('>') + 1;
  return std::string(svg.substr(0, inside)) + "\n<style><![CDATA[" + style_sheet() +
         "svg{background:var(--card);font-family:system-ui,sans-serif}]]></style>\n" +
         std::string(svg.substr(inside));
}

}  // namespace weft::daemon
