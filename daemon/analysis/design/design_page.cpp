#include "daemon/analysis/design/design_page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/document.hpp"

namespace weft::daemon {
namespace {

struct GridCell {
  double value = 0;    ///< determines the shade
  std::string words;   ///< text in the cell
  std::string second;  ///< text below it: the interval
};

/// Larger values are darker, from the least to the greatest value.
double shade_of(double value, double least, double most) {
  constexpr double lightest = 0.1, darkest = 0.95;
  return most > least ? lightest + (darkest - lightest) * (value - least) / (most - least)
                      : (lightest + darkest) / 2;
}

constexpr std::size_t most_maps = 12;

/// Factors with several values, as indices of SweepAnalysis::factors.
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

/// Cells of one map: they agree in all factors except its two.
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

/// A quantity that a map shows for each cell.
struct Quantity {
  std::string short_title;
  const char* title;
  GridCell (*of)(const SweepAnalysis&, std::size_t);
  bool less_is_better = false;
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

const std::array<Quantity, 4> quantities{
    {{"separability", "separability of the fabrics, cross-validated by replicate", separability_of},
     {"signal over noise", "texture signal over noise", snr_of},
     {"saturated", "share of counts at the limits of the taxel range", saturated_of, true},
     {"seconds", "recorded seconds per trial, median", seconds_of, true}}};

/// Rows start at the bottom, like an axis.
chart::Cells map_of(const SweepAnalysis& a, const std::vector<std::size_t>& vary,
                    const Slice& slice, const Quantity& quantity) {
  const std::size_t y_factor = vary.empty() ? 0 : vary[0];
  const std::optional<std::size_t> x_factor =
      vary.size() > 1 ? std::optional(vary[1]) : std::nullopt;
  const std::vector<double> ys = values_of(a, y_factor), xs = values_of(a, x_factor);
  chart::Cells out;
  const std::string stamp(bench_text(a.bench));
  out.title = quantity.short_title + ", " + stamp + (slice.words.empty() ? "" : ", " + slice.words);
  out.words = std::string(quantity.title) + ", " + stamp;
  out.y_title = factor_title(a.factors[y_factor]);
  out.x_title = x_factor ? factor_title(a.factors[*x_factor]) : "";
  for (std::size_t r = ys.size(); r-- > 0;)
    out.rows.push_back(general(factor_shown(a.factors[y_factor], ys[r])));
  for (const double x : xs)
    out.columns.push_back(x_factor ? general(factor_shown(a.factors[*x_factor], x)) : "");
  double least = HUGE_VAL, most = -HUGE_VAL;
  for (const std::size_t i : slice.cells) {
    least = std::min(least, quantity.of(a, i).value);
    most = std::max(most, quantity.of(a, i).value);
  }
  for (const std::size_t i : slice.cells) {
    const std::vector<double>& factors = a.cells[i].factors;
    const GridCell cell = quantity.of(a, i);
    out.cells.push_back({ys.size() - 1 - find_place(ys, factors[y_factor]),
                         x_factor ? find_place(xs, factors[*x_factor]) : 0, cell.words, cell.second,
                         shade_of(cell.value, least, most), chart::CellKind::hit,
                         i == a.choice.chosen});
  }
  return out;
}

/// The cells with the best value; empty if no value is a number.
std::vector<std::size_t> best_cells(const SweepAnalysis& a, const Quantity& quantity) {
  std::vector<std::size_t> best;
  for (std::size_t i = 0; i < a.cells.size(); ++i) {
    const double value = quantity.of(a, i).value;
    if (std::isnan(value)) continue;
    const double before = best.empty() ? value : quantity.of(a, best.front()).value;
    if (quantity.less_is_better ? value < before : value > before) best.clear();
    if (best.empty() || value == before) best.push_back(i);
  }
  return best;
}

/// "Best: 91.2 % at speed 5 mm/s, force 1 N, and at 2 other cells; chosen: ...".
std::string verdict_of(const SweepAnalysis& a, const Quantity& quantity) {
  const std::vector<std::size_t> best = best_cells(a, quantity);
  std::string out;
  if (!best.empty())
    out = "Best: " + quantity.of(a, best.front()).words + " at " + format_cell(a, best.front());
  if (best.size() > 1)
    out += ", and at " + std::to_string(best.size() - 1) +
           (best.size() == 2 ? " other cell" : " other cells");
  return out + (out.empty() ? "Chosen: " : "; chosen: ") + quantity.of(a, a.choice.chosen).words +
         " at " + format_cell(a, a.choice.chosen) + ".";
}

Blocks maps(const SweepAnalysis& a) {
  const std::vector<std::size_t> vary = varied(a);
  const std::vector<Slice> list = slices(a, vary);
  Blocks out;
  for (const Quantity& quantity : quantities) {
    Blocks body = paragraph("<b>" + escape(verdict_of(a, quantity)) + "</b>");
    for (std::size_t i = 0; i < std::min(list.size(), most_maps); ++i)
      body += picture(map_of(a, vary, list[i], quantity));
    out += figure(std::move(body),
                  std::string("Heat map of the ") + quantity.title +
                      ", with 95 % intervals. The diamond marks the chosen cell.",
                  bench_badge(a.bench));
  }
  return side_by_side(std::move(out));
}

Blocks front_figure(const SweepAnalysis& a) {
  const std::string stamp(bench_text(a.bench));
  std::vector<chart::FamilySample> points;
  for (std::size_t i = 0; i < a.cells.size(); ++i) {
    const auto& cell = a.choice.cells[i];
    const bool front = on_front(a, i);
    points.push_back({0,
                      {a.cells[i].seconds.value, cell.figures.accuracy * 100, cell.ci95.low * 100,
                       cell.ci95.high * 100, front ? format_cell(a, i) : "", front}});
  }
  chart::Plot plot{"Separability against seconds per trial, " + stamp, stamp};
  plot.panel_height = 300;
  plot.front_name = "Pareto front";
  plot.panels = {{{},
                  {.title = "recorded seconds per trial", .logarithmic = true},
                  chart::percent_axis("separability [%]", points)}};
  plot.panels.front().series = chart::series_of({"cell"}, points);
  return figure(
      picture(std::move(plot)),
      "Separability against recorded seconds per trial. Pareto front: no other cell is better in "
      "both accuracy and time. Times within 5 % count as equal. Where intervals overlap, the order "
      "may be chance.",
      bench_badge(a.bench));
}

Blocks table(const SweepAnalysis& a) {
  HtmlTable out({"cell", "trials", "accuracy [%]", "95 % interval", "signal over noise [dB]",
                 "saturated [%]", "time [s]", "Pareto front", "chosen in resamples [%]"});
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

Blocks simulated_note(BenchKind kind) {
  if (kind != BenchKind::simulated) return {};
  return paragraph(
      "<b>SIMULATED.</b> The plant model made these data; no fabric was touched. The best setting "
      "for the model may not be the best for real fabric.");
}

/// Each cell that is left out, with the reason.
Blocks left_out_list(const SweepAnalysis& a) {
  std::istringstream lines(format_left_out(a));
  Blocks out;
  for (std::string line; std::getline(lines, line);) out += note(escape(line));
  return out;
}

chart::Plot curve_plot(const RepetitionStudy& study) {
  const std::string stamp(bench_text(study.bench));
  std::vector<chart::FamilySample> points;
  for (const auto& p : study.curve.points)
    points.push_back({0,
                      {static_cast<double>(p.repetitions), p.accuracy * 100, p.ci95.low * 100,
                       p.ci95.high * 100}});
  const auto& f = study.forecast;
  points.push_back({1,
                    {static_cast<double>(f.predict), f.accuracy * 100, f.ci95.low * 100,
                     f.ci95.high * 100, "forecast"}});
  chart::Plot out{"Accuracy against repetitions, " + stamp, stamp};
  out.width = 1000;
  out.panel_height = 180;
  out.panels = {{{},
                 {.title = "repetitions", .logarithmic = true},
                 chart::percent_axis("accuracy [%]", points)}};
  out.panels.front().series = chart::series_of({"measured", "forecast"}, points);
  chart::Axis& y = out.panels.front().y;
  y.low = std::min(y.low, f.wanted * 100 - 2);
  y.high = std::max(y.high, f.wanted * 100 + 3);
  out.panels.front().limits = {{f.wanted * 100, "target " + general(f.wanted * 100) + " %"}};
  return out;
}

}  // namespace

Blocks design_section(const SweepAnalysis& a) {
  const std::string facts =
      std::to_string(a.cells.size()) + " cells, " + std::to_string(a.fabrics.size()) +
      " fabrics (" + escape(joined(a.fabrics)) + "), " + std::to_string(a.replicates) +
      " replicates; learner " + escape(a.learner) + "; textures of " +
      general(a.band.shortest_m * 1e3) + " to " + general(a.band.longest_m * 1e3) +
      " mm. Definitions: docs/explanation/campaign-design.md.";
  return section("Choice of settings: " + a.exploration,
                 paragraph("<b>" + escape(recommendation(a)) + "</b> " + bench_badge(a.bench)) +
                     left_out_list(a) + maps(a) + front_figure(a) +
                     figure(table(a), "All cells.", bench_badge(a.bench)) + paragraph(facts) +
                     simulated_note(a.bench));
}

Blocks design_section(const RepetitionStudy& study) {
  const std::string of = study.exploration.empty() ? "" : ": " + study.exploration;
  return section(
      "Number of repetitions" + of,
      paragraph(escape(format_repetition_study(study)) + " " + bench_badge(study.bench)) +
          figure(picture(curve_plot(study)),
                 "Learning curve, learner " + escape(study.learner) +
                     ": cross-validated by repetition, each size drawn " +
                     std::to_string(study.curve.draws) +
                     (study.curve.draws == 1 ? " time" : " times") +
                     ". Bars are 95 % intervals over the repetitions. The forecast is an inverse "
                     "power law. Its bar is the interval for the measured accuracy of such a "
                     "campaign, not for the true accuracy." +
                     (study.bench == BenchKind::simulated
                          ? " The plant model made these data; no fabric was touched."
                          : ""),
                 bench_badge(study.bench)));
}

Document design_document(std::string_view title, BenchKind bench, Blocks sections) {
  Document out{"design", std::string(title), std::string(bench_text(bench))};
  out.result = std::move(sections);
  return out;
}

}  // namespace weft::daemon
