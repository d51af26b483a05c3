#include "daemon/analysis/calibration/bootstrap.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "daemon/analysis/calibration/stroke_summary.hpp"
#include "sim/plant/random.hpp"

namespace weft::daemon::calibration {
namespace {

constexpr double tail = 0.025;

std::size_t draw(sim::Random& random, std::size_t count) {
  const auto drawn = static_cast<std::size_t>(random.uniform() * static_cast<double>(count));
  return std::min(drawn, count - 1);
}

/// Draws as many cells of each fabric, and strokes of each cell, as there are.
std::vector<DrawnCell> draw_sample(const Summaries& summaries, sim::Random& random) {
  std::vector<DrawnCell> out;
  for (std::size_t first = 0, last = 0; first < summaries.cells.size(); first = last) {
    while (last < summaries.cells.size() &&
           summaries.cells[last].cloth == summaries.cells[first].cloth)
      ++last;
    for (std::size_t k = first; k < last; ++k) {
      DrawnCell& drawn = out.emplace_back(DrawnCell{first + draw(random, last - first), {}});
      const std::vector<std::size_t>& strokes = summaries.cells[drawn.cell].strokes;
      for (std::size_t i = 0; i < strokes.size(); ++i)
        drawn.strokes.push_back(strokes[draw(random, strokes.size())]);
    }
  }
  return out;
}

BootstrapStatistic describe(const Statistic& statistic, const std::vector<double>& draws) {
  BootstrapStatistic out{statistic, 0, statistic.value, statistic.value, draws.size()};
  const auto error = sample_sd(draws);
  if (!error) return out;
  const double moved = statistic.value - *median(draws);
  out.standard_error = *error;
  out.low = std::min(statistic.value, *quantile(draws, tail) + moved);
  out.high = std::max(statistic.value, *quantile(draws, 1 - tail) + moved);
  return out;
}

}  // namespace

BootstrapSet bootstrap_statistics(const RecordingView& view, std::size_t draws,
                                  std::uint64_t seed) {
  const Summaries summaries = summarise(view);
  const StatisticSet own = combine(summaries, all_cells(summaries));
  std::map<std::pair<std::string, std::string>, std::vector<double>> values;
  for (std::size_t d = 0; d < draws; ++d) {
    sim::Random random(sim::mix(sim::mix(seed, "bootstrap"), d));
    for (const Statistic& s : combine(summaries, draw_sample(summaries, random)).statistics)
      values[{s.name, s.cloth}].push_back(s.value);
  }
  BootstrapSet out;
  out.remarks = own.remarks;
  for (const Statistic& s : own.statistics)
    out.statistics.push_back(describe(s, values[{s.name, s.cloth}]));
  return out;
}

}  // namespace weft::daemon::calibration
