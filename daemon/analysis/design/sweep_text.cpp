// What an analysis of a sweep says in words.
#include <array>

#include "daemon/analysis/design/sweep_analysis.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

constexpr std::size_t max_listed = 20;

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

std::string format_value(std::string_view factor, double si) {
  return general(factor_shown(factor, si)) + std::string(shown_as(factor).unit);
}

std::string format_interval(const classifier::Interval& interval) {
  return percent(interval.low) + " to " + percent(interval.high) + " %";
}

std::string format_stability(const SweepAnalysis& a) {
  std::string out = "In " + percent(a.choice.share, 0) + " % of " + thousands(a.choice.resamples) +
                    " pilots of the same size, drawn from these trials, the same cell is chosen";
  std::vector<std::string> values;
  for (const FactorShare& one : a.surest)
    values.push_back(format_value(a.factors[one.factor], one.value) + " in " +
                     percent(one.share, 0) + " %");
  if (!values.empty()) out += ", " + joined(values, " and ");
  return out + ".";
}

std::string format_seconds(const SweepAnalysis& a, std::size_t cell) {
  return fixed(a.cells[cell].seconds.value, 1) + " s";
}

/// Why this cell and no other: separability, then time, then signal over noise.
std::string format_rule(const SweepAnalysis& a) {
  const auto& c = a.choice;
  const std::string best = c.chosen == c.most_separable
                               ? "No cell tells more of them. "
                               : "The best cell, " + format_cell(a, c.most_separable) + ", tells " +
                                     percent(c.cells[c.most_separable].figures.accuracy) +
                                     " % in " + format_seconds(a, c.most_separable) + ". ";
  const std::string time = c.chosen == c.quickest
                               ? "Of the cells within one standard error (" + percent(c.within) +
                                     " points) none is quicker"
                               : "Of the cells within one standard error (" + percent(c.within) +
                                     " points) the " + "quickest, " + format_cell(a, c.quickest) +
                                     ", takes " + format_seconds(a, c.quickest) +
                                     ", which is as long";
  const std::string signal =
      c.equal_time > 1 ? "; of the " + std::to_string(c.equal_time) +
                             " that take as long this one has the largest signal over noise, " +
                             fixed(a.cells[c.chosen].snr_db.value, 1) + " dB"
                       : "";
  return best + time + signal + ".";
}

}  // namespace

std::string factor_title(std::string_view factor) {
  return std::string(shown_as(factor).title);
}

double factor_shown(std::string_view factor, double si) {
  return si * shown_as(factor).per_si;
}

std::string format_cell(const SweepAnalysis& analysis, std::size_t cell) {
  return format_cell(analysis, analysis.cells[cell].factors);
}

std::string format_cell(const SweepAnalysis& analysis, const std::vector<double>& factors) {
  std::vector<std::string> out;
  for (std::size_t f = 0; f < analysis.factors.size(); ++f)
    out.push_back(format_value(analysis.factors[f], factors[f]));
  return joined(out);
}

std::string recommendation(const SweepAnalysis& a) {
  const std::size_t i = a.choice.chosen;
  const auto& chosen = a.choice.cells[i];
  const std::string found = format_cell(a, i) + ": " + percent(chosen.figures.accuracy) +
                            " % of the trials told right (" + format_interval(chosen.ci95) + "), " +
                            format_seconds(a, i) + " a trial";
  const std::string others = std::to_string(a.choice.overlapping) + " of the " +
                             std::to_string(a.cells.size() - 1) +
                             " other cells have an interval that overlaps its own, " +
                             std::to_string(a.choice.quicker_overlapping) + " of them quicker.";
  if (a.choice.supported)
    return "Recommended is " + found + ". " + format_rule(a) + " " + format_stability(a) + " " +
           others;
  return "The data do not support a choice of one cell. The rule takes " + found + ", but " +
         others + " " + format_rule(a) + " " + format_stability(a) +
         " More replicates or fabrics would tell.";
}

std::string format_left_out(const SweepAnalysis& a) {
  std::string out;
  for (const std::string& one : a.without) out += "Left out, " + one + "\n";
  for (std::size_t i = 0; i < std::min(a.left_out.size(), max_listed); ++i)
    out += "Left out, " + format_cell(a, a.left_out[i].factors) + ": " + a.left_out[i].why + "\n";
  if (a.left_out.size() > max_listed)
    out += "Left out are " + std::to_string(a.left_out.size() - max_listed) + " more cells.\n";
  return out;
}

}  // namespace weft::daemon
