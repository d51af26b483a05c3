#include "classifier/design/cells.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "classifier/base/interval.hpp"
#include "classifier/design/resample.hpp"
#include "classifier/evaluate/splits.hpp"

namespace weft::classifier::design {
namespace {

constexpr std::size_t least_replicates = 3;
constexpr std::size_t error_resamples = 200;  // for the error of the median seconds

/// Statistics of all these trials together.
CellStatistics cell_statistics(const std::vector<CellTrial>& trials) {
  CellStatistics out;
  std::vector<double> seconds;
  for (const CellTrial& trial : trials) {
    const auto count = static_cast<double>(trials.size());
    out.accuracy += trial.right ? 1 : 0;
    out.snr_db += trial.snr_db / count;
    seconds.push_back(trial.seconds);
  }
  out.accuracy /= static_cast<double>(trials.size());
  out.seconds = quantile(std::move(seconds), 0.5);
  return out;
}

std::vector<CellTrial> all_trials(const WeighedCell& cell) {
  std::vector<CellTrial> out;
  for (const auto& fabric : cell.fabrics) out.insert(out.end(), fabric.begin(), fabric.end());
  return out;
}

std::vector<CellTrial> redrawn(const WeighedCell& cell, RandomEngine& engine) {
  std::vector<CellTrial> out;
  for (const auto& fabric : cell.fabrics)
    for (const std::size_t i : resampled(fabric.size(), engine)) out.push_back(fabric[i]);
  return out;
}

/// A resample of a resample. The first stands for a possible truth, the second for the trials that
/// a pilot study of the same size then finds.
std::vector<CellTrial> another_pilot(const WeighedCell& cell, RandomEngine& engine) {
  std::vector<CellTrial> out;
  for (const auto& fabric : cell.fabrics) {
    const std::vector<std::size_t> truth = resampled(fabric.size(), engine);
    for (const std::size_t i : resampled(fabric.size(), engine)) out.push_back(fabric[truth[i]]);
  }
  return out;
}

double median_error(const WeighedCell& cell, std::uint64_t seed) {
  RandomEngine engine(seed);
  std::vector<double> medians;
  for (std::size_t b = 0; b < error_resamples; ++b)
    medians.push_back(cell_statistics(redrawn(cell, engine)).seconds);
  return compute_deviation(medians);
}

ClusteredShare by_replicate(const WeighedCell& cell) {
  std::map<std::size_t, std::vector<double>> right;
  for (const CellTrial& trial : all_trials(cell))
    right[trial.replicate].push_back(trial.right ? 1 : 0);
  ClusteredShare out;
  for (const auto& [replicate, answers] : right)
    out.clusters.push_back({compute_mean(answers), static_cast<double>(answers.size())});
  return out;
}

/// Counts how often the rule chooses each cell in resampled pilot studies.
void draw_other_pilots(const std::vector<WeighedCell>& cells, double requested, std::uint64_t seed,
                       CellChoice& out) {
  RandomEngine engine(seed);
  const double widening = std::sqrt(out.design_effect);
  for (std::size_t b = 0; b < out.resamples; ++b) {
    std::vector<CellStatistics> drawn;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const CellStatistics& measured = out.cells[i].figures;
      CellStatistics& other = drawn.emplace_back(cell_statistics(another_pilot(cells[i], engine)));
      const double off = widening * (other.accuracy - measured.accuracy);
      other.accuracy = std::clamp(measured.accuracy + off, 0.0, 1.0);
      other.seconds_error = measured.seconds_error;
    }
    out.cells[take(drawn, requested)].chosen_share += 1 / static_cast<double>(out.resamples);
  }
}

/// Finds the quickest cell within one standard error of the best accuracy. Counts the cells within
/// that error that take no longer than it.
void count_equal_times(CellChoice& out) {
  const double enough = out.cells[out.most_separable].figures.accuracy - out.within;
  std::vector<std::size_t> within;
  for (std::size_t i = 0; i < out.cells.size(); ++i)
    if (out.cells[i].figures.accuracy >= enough) within.push_back(i);
  const auto seconds = [&](std::size_t i) { return out.cells[i].figures.seconds; };
  out.quickest = std::ranges::min(within, {}, seconds);
  const CellStatistics& quickest = out.cells[out.quickest].figures;
  out.equal_time = static_cast<std::size_t>(std::ranges::count_if(
      within, [&](std::size_t i) { return !is_cheaper(quickest, out.cells[i].figures); }));
}

void count_overlapping(CellChoice& out) {
  const CellSummary& chosen = out.cells[out.chosen];
  for (std::size_t i = 0; i < out.cells.size(); ++i) {
    const CellSummary& other = out.cells[i];
    if (i == out.chosen || other.ci95.low > chosen.ci95.high || chosen.ci95.low > other.ci95.high)
      continue;
    ++out.overlapping;
    out.quicker_overlapping += is_cheaper(other.figures, chosen.figures) ? 1 : 0;
  }
}

bool beats(const CellStatistics& a, const CellStatistics& b) {
  if (a.accuracy > b.accuracy) return !is_cheaper(b, a);
  return a.accuracy == b.accuracy && is_cheaper(a, b);
}

}  // namespace

std::size_t WeighedCell::requested() const {
  std::size_t sum = 0;
  for (const auto& fabric : fabrics) sum += fabric.size();
  return sum;
}

Result<std::vector<bool>> separability(const FeatureMatrix& matrix, Learner learner,
                                       std::uint64_t seed, const std::function<bool()>& stop) {
  const std::set<std::string> groups(matrix.groups.begin(), matrix.groups.end());
  const std::set<std::string> labels(matrix.labels.begin(), matrix.labels.end());
  if (groups.size() < least_replicates)
    return fail({.code = Errc::invalid_argument,
                 .where = "cell",
                 .what = "too few replicates for cross-validation",
                 .expected = "at least 3",
                 .got = std::to_string(groups.size())});
  if (labels.size() < 2)
    return fail({.code = Errc::invalid_argument,
                 .where = "cell",
                 .what = "too few fabrics to compare",
                 .expected = "at least 2",
                 .got = std::to_string(labels.size())});
  const auto splits = leave_one_group_out(matrix.groups, matrix.labels);
  if (!splits) return pass(splits.error());
  TrainOptions options;
  options.seed = seed;
  options.threads = 1;
  options.stop = stop;
  std::vector<bool> right(matrix.size(), false);
  std::size_t requested = 0;
  for (const Split& split : *splits) {
    const auto chosen = train_learner(select_rows(matrix, split.train), learner, options);
    if (!chosen) return pass(chosen.error());
    for (const std::size_t r : split.test) {
      const auto answer = chosen->trained.classify(matrix.values.row(r));
      if (!answer) return pass(answer.error(), matrix.files[r]);
      right[r] = chosen->trained.labels()[*answer] == matrix.labels[r];
      ++requested;
    }
  }
  if (requested < matrix.size())
    return fail({.code = Errc::invalid_argument,
                 .where = "cell",
                 .what = "fabric in only one replicate",
                 .expected = "each fabric in at least two replicates"});
  return right;
}

CellChoice choose_cell(const std::vector<WeighedCell>& cells, std::size_t resamples,
                       std::uint64_t seed) {
  CellChoice out;
  out.resamples = resamples;
  std::vector<CellStatistics> figures;
  std::vector<ClusteredShare> shares;
  for (const WeighedCell& cell : cells) {
    shares.push_back(by_replicate(cell));
    figures.push_back(cell_statistics(all_trials(cell)));
    figures.back().seconds_error = median_error(cell, seed);
  }
  out.design_effect = design_effect(shares);
  for (std::size_t i = 0; i < cells.size(); ++i)
    out.cells.push_back({figures[i], clustered_interval(shares[i], out.design_effect), 0});
  const double requested = static_cast<double>(cells.front().requested()) / out.design_effect;
  out.front = find_front(figures);
  out.chosen = take(figures, requested);
  const auto best = std::ranges::max_element(figures, {}, &CellStatistics::accuracy);
  out.most_separable = static_cast<std::size_t>(best - figures.begin());
  out.within = standard_error(best->accuracy, requested);
  draw_other_pilots(cells, requested, seed, out);
  out.share = out.cells[out.chosen].chosen_share;
  count_equal_times(out);
  count_overlapping(out);
  const auto fabrics = static_cast<double>(cells[out.chosen].fabrics.size());
  const bool separates = out.cells[out.chosen].ci95.low > 1 / fabrics;
  out.supported =
      cells.size() > 1 && separates && out.share >= stable_share && out.quicker_overlapping == 0;
  return out;
}

double seconds_tolerance(const CellStatistics& a, const CellStatistics& b) {
  return std::max(equal_seconds_share * std::min(a.seconds, b.seconds),
                  z95 * std::hypot(a.seconds_error, b.seconds_error));
}

bool is_cheaper(const CellStatistics& a, const CellStatistics& b) {
  return b.seconds - a.seconds > seconds_tolerance(a, b);
}

double standard_error(double accuracy, double requested) {
  const double p = (accuracy * requested + 0.5) / (requested + 1);
  return std::sqrt(p * (1 - p) / requested);
}

std::size_t take(std::span<const CellStatistics> cells, double requested) {
  const double best = std::ranges::max(cells, {}, &CellStatistics::accuracy).accuracy;
  const double enough = best - standard_error(best, requested);
  const CellStatistics* quickest = nullptr;
  for (const CellStatistics& cell : cells)
    if (cell.accuracy >= enough && (quickest == nullptr || cell.seconds < quickest->seconds))
      quickest = &cell;
  const CellStatistics* taken = quickest;
  for (const CellStatistics& cell : cells)
    if (cell.accuracy >= enough && !is_cheaper(*quickest, cell) && cell.snr_db > taken->snr_db)
      taken = &cell;
  return static_cast<std::size_t>(taken - cells.data());
}

std::vector<std::size_t> find_front(std::span<const CellStatistics> cells) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (std::ranges::none_of(cells, [&](const CellStatistics& c) { return beats(c, cells[i]); }))
      out.push_back(i);
  std::ranges::stable_sort(out, {}, [&](std::size_t i) { return cells[i].seconds; });
  return out;
}

}  // namespace weft::classifier::design
