#include "classifier/design/cells.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "classifier/design/resample.hpp"
#include "classifier/evaluate/splits.hpp"

namespace weft::classifier::design {
namespace {

constexpr std::size_t least_replicates = 3;

std::size_t count_right(const CellAnswers& answers) {
  std::size_t sum = 0;
  for (const auto& fabric : answers.right)
    sum += static_cast<std::size_t>(std::ranges::count(fabric, true));
  return sum;
}

/// Of an accuracy of 0 or 1 as if half an answer more were the other way.
double standard_error(double accuracy, double asked) {
  const double p = (accuracy * asked + 0.5) / (asked + 1);
  return std::sqrt(p * (1 - p) / asked);
}

/// What the rule takes when the cells have these accuracies.
std::size_t take(const std::vector<WeighedCell>& cells, const std::vector<double>& accuracy) {
  const auto best = static_cast<std::size_t>(std::ranges::max_element(accuracy) - accuracy.begin());
  const auto asked = static_cast<double>(cells[best].answers.asked());
  const double enough = accuracy[best] - standard_error(accuracy[best], asked);
  std::size_t taken = best;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (accuracy[i] < enough) continue;
    const bool quicker = cells[i].seconds < cells[taken].seconds;
    const bool same = cells[i].seconds == cells[taken].seconds;
    if (quicker || (same && cells[i].snr_db > cells[taken].snr_db)) taken = i;
  }
  return taken;
}

/// Of a resample of a resample: the first stands for what the truth may be, the second for what a
/// pilot of the same size then finds.
double another_accuracy(const CellAnswers& answers, RandomEngine& engine) {
  std::size_t right = 0;
  for (const auto& fabric : answers.right) {
    const std::vector<std::size_t> truth = resampled(fabric.size(), engine);
    for (const std::size_t i : resampled(fabric.size(), engine)) right += fabric[truth[i]] ? 1 : 0;
  }
  return static_cast<double>(right) / static_cast<double>(answers.asked());
}

bool overlap(const Interval& a, const Interval& b) {
  return a.low <= b.high && b.low <= a.high;
}

}  // namespace

std::size_t CellAnswers::asked() const {
  return std::accumulate(right.begin(), right.end(), std::size_t{0},
                         [](std::size_t sum, const auto& fabric) { return sum + fabric.size(); });
}

double CellAnswers::accuracy() const {
  return static_cast<double>(count_right(*this)) / static_cast<double>(asked());
}

Result<CellAnswers> separability(const FeatureMatrix& matrix, Learner learner, std::uint64_t seed,
                                 const std::function<bool()>& stop) {
  const std::set<std::string> groups(matrix.groups.begin(), matrix.groups.end());
  if (groups.size() < least_replicates)
    return fail(Errc::invalid_argument, "too few replicates to leave one out", "cell", "at least 3",
                std::to_string(groups.size()));
  const auto splits = leave_one_group_out(matrix.groups, matrix.labels);
  if (!splits) return pass(splits.error());
  TrainOptions options;
  options.seed = seed;
  options.threads = 1;
  options.stop = stop;
  std::map<std::string, std::vector<bool>> right;
  for (const Split& split : *splits) {
    const auto chosen = train_learner(take_rows(matrix, split.train), learner, options);
    if (!chosen) return pass(chosen.error());
    for (const std::size_t r : split.test) {
      const auto answer = chosen->trained.classify(matrix.values.row(r));
      if (!answer) return pass(answer.error(), matrix.files[r]);
      right[matrix.labels[r]].push_back(chosen->trained.labels()[*answer] == matrix.labels[r]);
    }
  }
  if (right.size() < 2)
    return fail(Errc::invalid_argument, "there is nothing to tell apart", "cell", "2 fabrics",
                std::to_string(right.size()));
  CellAnswers out;
  for (auto& [label, answers] : right) out.right.push_back(std::move(answers));
  return out;
}

CellChoice choose_cell(const std::vector<WeighedCell>& cells, std::size_t resamples,
                       std::uint64_t seed) {
  CellChoice out;
  out.resamples = resamples;
  std::vector<double> accuracy;
  for (const WeighedCell& cell : cells) {
    accuracy.push_back(cell.answers.accuracy());
    const std::size_t right = count_right(cell.answers);
    CellSummary& summary = out.cells.emplace_back();
    summary.accuracy = accuracy.back();
    summary.ci95 = wilson_interval(right, cell.answers.asked());
  }
  out.chosen = take(cells, accuracy);
  out.most_separable =
      static_cast<std::size_t>(std::ranges::max_element(accuracy) - accuracy.begin());
  out.within = standard_error(accuracy[out.most_separable],
                              static_cast<double>(cells[out.most_separable].answers.asked()));
  RandomEngine engine(seed);
  for (std::size_t b = 0; b < resamples; ++b) {
    std::vector<double> drawn;
    for (const WeighedCell& cell : cells) drawn.push_back(another_accuracy(cell.answers, engine));
    out.cells[take(cells, drawn)].chosen_share += 1 / static_cast<double>(resamples);
  }
  out.share = out.cells[out.chosen].chosen_share;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i == out.chosen || !overlap(out.cells[i].ci95, out.cells[out.chosen].ci95)) continue;
    ++out.overlapping;
    out.quicker_overlapping += cells[i].seconds < cells[out.chosen].seconds ? 1 : 0;
  }
  const auto fabrics = static_cast<double>(cells[out.chosen].answers.right.size());
  const bool separates = out.cells[out.chosen].ci95.low > 1 / fabrics;
  out.supported =
      cells.size() > 1 && separates && out.share >= stable_share && out.quicker_overlapping == 0;
  return out;
}

}  // namespace weft::classifier::design
