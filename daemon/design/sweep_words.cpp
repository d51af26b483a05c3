// What an analysis of a sweep says in words.
#include <array>

#include "daemon/design/sweep_analysis.hpp"
#include "daemon/report/format.hpp"

namespace weft::daemon {
namespace {

struct Shown {
  std::string_view name, title, unit;
  double per_si;
};
constexpr std::array shown{
    Shown{"force_n", "force [N]", " N", 1}, Shown{"speed_mps", "speed [mm/s]", " mm/s", 1e3},
    Shown{"press_s", "press [s]", " s", 1}, Shown{"stroke_m", "stroke [mm]", " mm", 1e3}};

/// A factor that a later version knows is shown as it is.
Shown shown_as(std::string_view factor) {
  for (const Shown& one : shown)
    if (one.name == factor) return one;
  return {factor, factor, "", 1};
}

std::string value_words(std::string_view factor, double si) {
  return general(factor_shown(factor, si)) + std::string(shown_as(factor).unit);
}

std::string interval_words(const classifier::Interval& interval) {
  return percent(interval.low) + " to " + percent(interval.high) + " %";
}

std::string stability_words(const SweepAnalysis& a) {
  std::string out = "In " + percent(a.choice.share, 0) + " % of " + thousands(a.choice.resamples) +
                    " pilots of the same size, drawn from these trials, the same cell is chosen";
  std::vector<std::string> values;
  for (const FactorShare& one : a.surest)
    values.push_back(value_words(a.factors[one.factor], one.value) + " in " +
                     percent(one.share, 0) + " %");
  if (!values.empty()) out += ", " + joined(values, " and ");
  return out + ".";
}

}  // namespace

std::string factor_title(std::string_view factor) {
  return std::string(shown_as(factor).title);
}

double factor_shown(std::string_view factor, double si) {
  return si * shown_as(factor).per_si;
}

std::string cell_words(const SweepAnalysis& analysis, std::size_t cell) {
  std::vector<std::string> out;
  for (std::size_t f = 0; f < analysis.factors.size(); ++f)
    out.push_back(value_words(analysis.factors[f], analysis.cells[cell].factors[f]));
  return joined(out);
}

std::string recommendation(const SweepAnalysis& a) {
  const std::size_t i = a.choice.chosen, best = a.choice.most_separable;
  const auto& chosen = a.choice.cells[i];
  const std::string found = cell_words(a, i) + ": " + percent(chosen.accuracy) +
                            " % of the trials told right (" + interval_words(chosen.ci95) + "), " +
                            fixed(a.cells[i].seconds.mean, 1) + " s a trial";
  const std::string rule =
      i == best ? "No cell tells more of them, and none that tells as many within one standard "
                  "error (" +
                      percent(a.choice.within) + " points) is quicker."
                : "It is the quickest of the cells within one standard error (" +
                      percent(a.choice.within) + " points) of the best, " + cell_words(a, best) +
                      " (" + percent(a.choice.cells[best].accuracy) + " %, " +
                      fixed(a.cells[best].seconds.mean, 1) + " s).";
  const std::string others = std::to_string(a.choice.overlapping) + " of the " +
                             std::to_string(a.cells.size() - 1) +
                             " other cells have an interval that overlaps its own, " +
                             std::to_string(a.choice.quicker_overlapping) + " of them quicker.";
  if (a.choice.supported)
    return "Recommended is " + found + ". " + rule + " " + stability_words(a) + " " + others;
  return "The data do not support a choice of one cell. The rule takes " + found + ", but " +
         others + " " + stability_words(a) + " More replicates or fabrics would tell.";
}

}  // namespace weft::daemon
