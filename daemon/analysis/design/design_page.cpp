#include "daemon/analysis/design/design_page.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"
#include "daemon/pages/plot/scatter.hpp"
#include "daemon/pages/plot/svg.hpp"

namespace weft::daemon {
namespace {

struct GridCell {
  double value = 0;     ///< decides the shade
  std::string words;    ///< written in the cell
  std::string second;   ///< and beneath it, smaller: the interval
  bool marked = false;  ///< a diamond: the recommended one
};

struct GridMap {
  std::string title;  ///< read out in the picture's place
  std::string stamp;  ///< written into the picture: "SIMULATED"
  std::string x_title, y_title;
  std::vector<std::string> x, y;  ///< labels of columns and rows
  /// [rows][columns]; nothing where the design has no such cell.
  std::vector<std::vector<std::optional<GridCell>>> cells;
};

constexpr struct { double left = 62, top = 22, bottom = 40, right = 8; } margins;
constexpr struct { double width = 96, height = 38; } cell_size;
constexpr double lightest = 0.1, darkest = 0.95, light_on_dark = 0.72;

struct Values {
  double least = HUGE_VAL, most = -HUGE_VAL;
  [[nodiscard]] double shade(double value) const {
    return most > least ? lightest + (darkest - lightest) * (value - least) / (most - least)
                        : (lightest + darkest) / 2;
  }
};

Values values_of(const GridMap& map) {
  Values out;
  for (const auto& row : map.cells)
    for (const auto& cell : row) {
      if (!cell) continue;
      out.least = std::min(out.least, cell->value);
      out.most = std::max(out.most, cell->value);
    }
  return out;
}

void draw(svg::Canvas& canvas, const GridCell& cell, double shade, const svg::Box& box) {
  canvas.rect(box, "cell-hit", shade);
  const char* const on = shade > light_on_dark ? "cell-text on" : "cell-text";
  const double middle = box.x + box.width / 2;
  canvas.text({middle, box.y + 16}, cell.words, on, svg::Anchor::middle);
  canvas.text({middle, box.y + 30}, cell.second, on, svg::Anchor::middle);
  if (cell.marked) canvas.diamond({box.x + 9, box.y + 9}, 5, on);
}

/// <svg>: the darker the larger, from the least to the greatest value of the map; rows from below.
std::string grid_map(const GridMap& map) {
  const auto columns = static_cast<double>(map.x.size()), rows = static_cast<double>(map.y.size());
  svg::Canvas canvas(margins.left + columns * cell_size.width + margins.right,
                     margins.top + rows * cell_size.height + margins.bottom, map.title, "heat");
  canvas.text({margins.left, 14}, map.stamp, "axis-title");
  const Values values = values_of(map);
  for (std::size_t r = 0; r < map.y.size(); ++r) {
    const double y = margins.top + (rows - 1 - static_cast<double>(r)) * cell_size.height;
    canvas.text({margins.left - 6, y + cell_size.height / 2 + 4}, map.y[r], "tick",
                svg::Anchor::end);
    for (std::size_t c = 0; c < map.x.size(); ++c) {
      const svg::Box box{margins.left + static_cast<double>(c) * cell_size.width + 0.5, y + 0.5,
                         cell_size.width - 1, cell_size.height - 1};
      if (map.cells[r][c])
        draw(canvas, *map.cells[r][c], values.shade(map.cells[r][c]->value), box);
      else
        canvas.rect(box, "cell-empty");
    }
  }
  for (std::size_t c = 0; c < map.x.size(); ++c)
    canvas.text({margins.left + (static_cast<double>(c) + 0.5) * cell_size.width,
                 margins.top + rows * cell_size.height + 15},
                map.x[c], "tick", svg::Anchor::middle);
  canvas.text(
      {margins.left + columns * cell_size.width / 2, margins.top + rows * cell_size.height + 32},
      map.x_title, "axis-title", svg::Anchor::middle);
  canvas.text({12, margins.top + rows * cell_size.height / 2}, map.y_title, "axis-title",
              svg::Anchor::middle, true);
  return canvas.finish();
}

constexpr std::size_t most_maps = 12;

/// The factors that have several values, by their place in SweepAnalysis::factors.
std::vector<std::size_t> varied(const SweepAnalysis& a) {
  std::vector<std::size_t> out;
  for (std::size_t f = 0; f < a.factors.size(); ++f) {
    std::set<double> values;
    for (const SweepCell& cell : a.cells) values.insert(cell.factors[f]);
    if (values.size() > 1) out.push_back(f);
  }
  return out;
}

std::vector<double> values_of(const SweepAnalysis& a, std::optional<std::size_t> factor) {
  if (!factor) return {0};
  std::set<double> values;
  for (const SweepCell& cell : a.cells) values.insert(cell.factors[*factor]);
  return {values.begin(), values.end()};
}

std::size_t find_place(const std::vector<double>& values, double value) {
  return static_cast<std::size_t>(std::ranges::find(values, value) - values.begin());
}

/// Cells of one map: those that agree in all factors but its two.
struct Slice {
  std::string words;
  std::vector<std::size_t> cells;
};

std::vector<Slice> slices(const SweepAnalysis& a, const std::vector<std::size_t>& vary) {
  std::map<std::vector<double>, Slice> out;
  for (std::size_t i = 0; i < a.cells.size(); ++i) {
    std::vector<double> key;
    std::vector<std::string> words;
    for (std::size_t k = 2; k < vary.size(); ++k) {
      const double value = a.cells[i].factors[vary[k]];
      key.push_back(value);
      words.push_back(factor_title(a.factors[vary[k]]) + " " +
                      general(factor_shown(a.factors[vary[k]], value)));
    }
    Slice& slice = out[key];
    slice.words = joined(words);
    slice.cells.push_back(i);
  }
  std::vector<Slice> list;
  for (auto& [key, slice] : out) list.push_back(std::move(slice));
  return list;
}

/// What a map shows of a cell.
struct Quantity {
  const char* title;
  GridCell (*of)(const SweepAnalysis&, std::size_t);
};

GridCell separability_of(const SweepAnalysis& a, std::size_t i) {
  const auto& cell = a.choice.cells[i];
  return {cell.figures.accuracy, percent(cell.figures.accuracy) + " %",
          percent(cell.ci95.low, 0) + " to " + percent(cell.ci95.high, 0)};
}

GridCell grid_cell(const CellValue& m, const char* unit) {
  return {m.value, fixed(m.value, 1) + unit, fixed(m.ci95.low, 1) + " to " + fixed(m.ci95.high, 1)};
}

GridCell snr_of(const SweepAnalysis& a, std::size_t i) {
  return grid_cell(a.cells[i].snr_db, " dB");
}

GridCell saturated_of(const SweepAnalysis& a, std::size_t i) {
  const CellValue& m = a.cells[i].saturated_share;
  return {m.value, percent(m.value, 2) + " %",
          percent(m.ci95.low, 2) + " to " + percent(m.ci95.high, 2)};
}

GridCell seconds_of(const SweepAnalysis& a, std::size_t i) {
  return grid_cell(a.cells[i].seconds, " s");
}

constexpr Quantity quantities[]{
    {"separability of the fabrics, leaving each replicate out", separability_of},
    {"texture signal over noise", snr_of},
    {"share of values at an end of the taxels' range", saturated_of},
    {"seconds on record per trial, median", seconds_of}};

std::string map_of(const SweepAnalysis& a, const std::vector<std::size_t>& vary, const Slice& slice,
                   const Quantity& quantity) {
  const std::size_t y_factor = vary.empty() ? 0 : vary[0];
  const std::optional<std::size_t> x_factor =
      vary.size() > 1 ? std::optional(vary[1]) : std::nullopt;
  const std::vector<double> ys = values_of(a, y_factor), xs = values_of(a, x_factor);
  GridMap map;
  map.stamp = std::string(bench_text(a.bench)) + (slice.words.empty() ? "" : ", " + slice.words);
  map.title = std::string(quantity.title) + ", " + map.stamp;
  map.y_title = factor_title(a.factors[y_factor]);
  map.x_title = x_factor ? factor_title(a.factors[*x_factor]) : "";
  for (const double y : ys) map.y.push_back(general(factor_shown(a.factors[y_factor], y)));
  for (const double x : xs)
    map.x.push_back(x_factor ? general(factor_shown(a.factors[*x_factor], x)) : "");
  map.cells.assign(ys.size(), std::vector<std::optional<GridCell>>(xs.size()));
  for (const std::size_t i : slice.cells) {
    const std::vector<double>& factors = a.cells[i].factors;
    GridCell cell = quantity.of(a, i);
    cell.marked = i == a.choice.chosen;
    map.cells[find_place(ys, factors[y_factor])]
             [x_factor ? find_place(xs, factors[*x_factor]) : 0] = std::move(cell);
  }
  return "<div class=\"scroll\">" + grid_map(map) + "</div>\n";
}

std::string maps(const SweepAnalysis& a) {
  const std::vector<std::size_t> vary = varied(a);
  const std::vector<Slice> list = slices(a, vary);
  std::string out;
  for (const Quantity& quantity : quantities) {
    std::string body;
    for (std::size_t i = 0; i < std::min(list.size(), most_maps); ++i)
      body += map_of(a, vary, list[i], quantity);
    out += figure(body,
                  std::string("Heat map of the ") + quantity.title +
                      ", with 95 % intervals; the diamond marks the cell that the rule takes.",
                  bench_badge(a.bench));
  }
  return out;
}

std::string front_figure(const SweepAnalysis& a) {
  const std::string stamp(bench_text(a.bench));
  ScatterPanel panel{"", "seconds on record per trial", {}};
  for (std::size_t i = 0; i < a.cells.size(); ++i) {
    const auto& cell = a.choice.cells[i];
    panel.points.push_back({a.cells[i].seconds.value, cell.figures.accuracy, cell.ci95.low,
                            cell.ci95.high, 0, on_front(a, i), format_cell(a, i)});
  }
  const Scatter scatter{"Separability against seconds of a trial, " + stamp,
                        "separability [%]",
                        stamp,
                        {"cell"},
                        {std::move(panel)}};
  return figure(
      "<div class=\"scroll\">" + scatter_figure(scatter) + "</div>\n",
      "Separability against the seconds of a trial: on the front no other cell tells more in "
      "the same time or as many in less; times within 5 % are the same. Where intervals "
      "overlap, the order may be chance.",
      bench_badge(a.bench));
}

std::string table(const SweepAnalysis& a) {
  HtmlTable out({"cell", "trials", "told right %", "95 %", "signal over noise dB", "saturated %",
                 "seconds", "front", "chosen by % of other pilots"});
  for (std::size_t i = 0; i < a.cells.size(); ++i) {
    const SweepCell& cell = a.cells[i];
    const auto& summary = a.choice.cells[i];
    out.row({escape(format_cell(a, i)), thousands(cell.trials), percent(summary.figures.accuracy),
             percent(summary.ci95.low) + " to " + percent(summary.ci95.high),
             fixed(cell.snr_db.value, 1), percent(cell.saturated_share.value, 2),
             fixed(cell.seconds.value, 1), on_front(a, i) ? "\u25C6" : "",
             percent(summary.chosen_share)},
            i == a.choice.chosen ? "on-front" : "");
  }
  return out.finish();
}

std::string simulated_html(BenchKind kind) {
  if (kind != BenchKind::simulated) return {};
  return "<div class=\"note\"><p><b>SIMULATED.</b> The plant model made these data; no cloth was "
         "touched. What is best on it need not be best on cloth.</p></div>\n";
}

/// Each cell that is left out, and why.
std::string left_out_list(const SweepAnalysis& a) {
  std::istringstream lines(format_left_out(a));
  std::string items;
  for (std::string line; std::getline(lines, line);) items += "<p>" + escape(line) + "</p>\n";
  return items.empty() ? items : "<div class=\"note\">" + items + "</div>\n";
}

ScatterPanel curve_panel(const RepetitionStudy& study) {
  ScatterPanel panel{"", "repetitions", {}, {}, true};
  for (const auto& p : study.curve.points)
    panel.points.push_back(
        {static_cast<double>(p.repetitions), p.accuracy, p.ci95.low, p.ci95.high, 0, false, ""});
  const auto& f = study.forecast;
  panel.points.push_back(
      {static_cast<double>(f.predict), f.accuracy, f.ci95.low, f.ci95.high, 1, false, "expected"});
  panel.lines = {{f.wanted, "wanted " + percent(f.wanted) + " %"}};
  return panel;
}

}  // namespace

std::string design_section(const SweepAnalysis& a) {
  return "<section>\n<h2>Which setting: " + escape(a.exploration) + " " + bench_badge(a.bench) +
         "</h2>\n" + simulated_html(a.bench) + "<p>" + escape(recommendation(a)) + "</p>\n" +
         left_out_list(a) + "<p>" + std::to_string(a.cells.size()) + " cells, " +
         std::to_string(a.fabrics.size()) + " fabrics (" + escape(joined(a.fabrics)) + "), " +
         std::to_string(a.replicates) + " replicates; learner " + escape(a.learner) +
         "; textures of " + general(a.band.shortest_m * 1e3) + " to " +
         general(a.band.longest_m * 1e3) + " mm. Definitions: docs/design.md.</p>\n" + maps(a) +
         front_figure(a) + figure(table(a), "All cells.", bench_badge(a.bench)) + "</section>\n";
}

std::string design_section(const RepetitionStudy& study) {
  const std::string stamp(bench_text(study.bench));
  const Scatter scatter{"Accuracy against repetitions, " + stamp,
                        "accuracy [%]",
                        stamp,
                        {"measured", "expected"},
                        {curve_panel(study)}};
  const std::string of = study.exploration.empty() ? "" : ": " + study.exploration;
  return "<section>\n<h2>How many repetitions" + escape(of) + " " + bench_badge(study.bench) +
         "</h2>\n" + simulated_html(study.bench) + "<p>" + escape(format_repetition_study(study)) +
         "</p>\n" +
         figure("<div class=\"scroll\">" + scatter_figure(scatter) + "</div>\n",
                "Learning curve, learner " + escape(study.learner) +
                    ": each repetition left out in turn, each size drawn " +
                    std::to_string(study.curve.draws) +
                    (study.curve.draws == 1 ? " time" : " times") +
                    "; bars are 95 % intervals over the repetitions. Expected: an inverse power "
                    "law; its bar is the interval of what "
                    "such a campaign would measure, not of its true accuracy.",
                bench_badge(study.bench)) +
         "</section>\n";
}

std::string design_page(std::string_view title, BenchKind bench, std::string_view sections_html) {
  return page_around(title, "<header>" + bench_badge(bench) + "\n<h1>" + escape(title) +
                                "</h1></header>\n" + std::string(sections_html));
}

}  // namespace weft::daemon
