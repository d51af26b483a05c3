#include "daemon/analysis/calibration/objective.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace weft::daemon::calibration {
namespace {

constexpr double least_target_sd = 0.02;  // 2 %: no model of this kind is more accurate
constexpr double missing_residual = 5;
constexpr std::size_t reported_evaluations = 100;

/// Standard deviation over the replicates that have the statistic; 0 if fewer than two do.
double sd_over(std::span<const StatisticSet> sets, const Statistic& like) {
  double sum = 0, squares = 0, count = 0;
  for (const StatisticSet& set : sets)
    if (const Statistic* one = find(set.statistics, like.name, like.cloth)) {
      sum += one->value;
      squares += one->value * one->value;
      ++count;
    }
  if (count < 2) return 0;
  return std::sqrt(std::max(0.0, squares - sum * sum / count) / (count - 1));
}

}  // namespace

bool is_fitted(std::string_view statistic) {
  static constexpr std::array<std::string_view, 9> names{
      "modulation", "modulation_within", "modulation_stroke", "neighbours", "far", "common_share",
      "drift",      "repetition",        "repetition_lag"};
  return std::ranges::find(names, statistic) != names.end() || statistic.starts_with("band_") ||
         statistic.starts_with("pattern_");
}

std::vector<Target> make_targets(const BootstrapSet& real,
                                 std::span<const StatisticSet> replicates) {
  std::vector<Target> out;
  for (const BootstrapStatistic& one : real.statistics) {
    const Statistic& statistic = one.statistic;
    const auto has = [&](const StatisticSet& set) {
      return find(set.statistics, statistic.name, statistic.cloth) != nullptr;
    };
    if (!is_fitted(statistic.name) || !std::ranges::any_of(replicates, has)) continue;
    const double sd = std::hypot(one.standard_error, sd_over(replicates, statistic));
    out.push_back({statistic, std::max(sd, least_target_sd)});
  }
  return out;
}

std::vector<double> residuals(std::span<const Target> targets, const StatisticSet& simulated) {
  std::vector<double> out;
  for (const Target& target : targets) {
    const Statistic* one = find(simulated.statistics, target.real.name, target.real.cloth);
    out.push_back(one == nullptr ? missing_residual : (one->value - target.real.value) / target.sd);
  }
  return out;
}

double sum_of_squares(std::span<const double> residuals) {
  double sum = 0;
  for (const double r : residuals) sum += r * r;
  return sum;
}

Result<std::vector<double>> Objective::residuals_at(std::span<const double> values) {
  const auto view = scene_->simulate(values, seed_, threads_);
  if (!view) return pass(view.error());
  if (++evaluations_ % reported_evaluations == 0 && progress_) progress_(evaluations_);
  return residuals(targets_, compute_statistics(*view));
}

Result<double> Objective::cost_at(std::span<const double> values) {
  const auto out = residuals_at(values);
  if (!out) return pass(out.error());
  return sum_of_squares(*out);
}

}  // namespace weft::daemon::calibration
