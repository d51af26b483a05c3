#include "classifier/vote/novelty.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "classifier/base/parallel.hpp"
#include "protocols/base/names.hpp"

namespace weft::classifier {
namespace {

constexpr NameTable<RejectKind, reject_kinds> kind_names = {{
    {RejectKind::neighbour, "neighbour"},
    {RejectKind::class_mean, "class_mean"},
    {RejectKind::probability, "probability"},
}};
constexpr double infinite = std::numeric_limits<double>::infinity();

// Rows by class and by unit.
struct Rows {
  std::span<const std::size_t> own;
  std::span<const std::size_t> unit;
};

// Distance of row `at` to the nearest row of its class, of another unit than its own and than
// `without`; infinite when there is none.
double compute_radius(const Matrix& trial, std::span<const double> deviation, const Rows& rows,
                      std::size_t at, std::size_t without) {
  std::vector<std::size_t> others;
  for (std::size_t j = 0; j < rows.own.size(); ++j)
    if (rows.own[j] == rows.own[at] && rows.unit[j] != rows.unit[at] && rows.unit[j] != without)
      others.push_back(j);
  const std::vector<double> distance =
      scaled_distances(trial.take(others), deviation, trial.row(at));
  return distance.empty() ? infinite : *std::min_element(distance.begin(), distance.end());
}

bool usable(double length) {
  return length > 0.0 && std::isfinite(length);
}

double mean_of_usable(const std::vector<double>& lengths, double otherwise) {
  double sum = 0.0, count = 0.0;
  for (const double length : lengths) {
    if (!usable(length)) continue;
    sum += length;
    count += 1.0;
  }
  return usable(sum) ? sum / count : otherwise;
}

// Lengths that say nothing take the mean of their class, of all, or 1.
void fill_unusable(std::vector<double>& lengths, std::span<const std::size_t> own,
                   std::size_t classes) {
  std::vector<std::vector<double>> of_class(classes);
  for (std::size_t r = 0; r < lengths.size(); ++r) of_class[own[r]].push_back(lengths[r]);
  const double all = mean_of_usable(lengths, 1.0);
  for (std::size_t r = 0; r < lengths.size(); ++r)
    if (!usable(lengths[r])) lengths[r] = mean_of_usable(of_class[own[r]], all);
}

// Distance of row `at` to the mean of its class without its unit; infinite when nothing is left.
double distance_to_rest(const Matrix& trial, std::span<const double> deviation, const Rows& rows,
                        std::size_t at) {
  std::vector<std::size_t> rest;
  for (std::size_t j = 0; j < rows.own.size(); ++j)
    if (rows.own[j] == rows.own[at] && rows.unit[j] != rows.unit[at]) rest.push_back(j);
  if (rest.empty()) return infinite;
  Matrix mean(1, trial.cols());
  for (const std::size_t j : rest)
    for (std::size_t k = 0; k < trial.cols(); ++k)
      mean(0, k) += trial(j, k) / static_cast<double>(rest.size());
  return scaled_distances(mean, deviation, trial.row(at)).front();
}

double over(double distance, double length) {
  const double ratio = distance / length;
  return std::isnan(ratio) ? infinite : ratio;
}

}  // namespace

std::string_view to_string(RejectKind kind) {
  return name_in(kind_names, kind);
}

Result<RejectKind> reject_kind_from(std::string_view text) {
  return value_from(kind_names, text, "unknown reject rule",
                    "neighbour, class_mean or probability");
}

RejectRule fit_reject(const FeatureMatrix& matrix, const ClassProfile& profile,
                      std::span<const std::size_t> own, std::span<const std::size_t> unit,
                      std::size_t threads) {
  RejectRule out;
  out.trial = matrix.values;
  const Rows rows{own, unit};
  std::vector<double> to_mean(own.size());
  out.radius.resize(own.size());
  parallel_for(own.size(), threads, [&](std::size_t r) {
    out.radius[r] = compute_radius(out.trial, profile.deviation, rows, r, unit[r]);
    to_mean[r] = distance_to_rest(out.trial, profile.deviation, rows, r);
  });
  fill_unusable(out.radius, own, profile.classes());
  fill_unusable(to_mean, own, profile.classes());
  std::vector<std::vector<double>> of_class(profile.classes());
  for (std::size_t r = 0; r < own.size(); ++r) of_class[own[r]].push_back(to_mean[r]);
  for (const auto& lengths : of_class) out.spread.push_back(mean_of_usable(lengths, 1.0));
  return out;
}

Novelty novelty(const RejectRule& rule, const ClassProfile& profile,
                std::span<const double> features, std::size_t winner, double probability) {
  const std::vector<double> to_trial = scaled_distances(rule.trial, profile.deviation, features);
  const auto nearest = std::min_element(to_trial.begin(), to_trial.end());
  const std::vector<double> to_mean = scaled_distances(profile.mean, profile.deviation, features);
  return {over(*nearest, rule.radius[static_cast<std::size_t>(nearest - to_trial.begin())]),
          over(to_mean[winner], rule.spread[winner]), 1.0 - probability};
}

Novelty training_novelty(const RejectRule& rule, const ClassProfile& profile,
                         std::span<const std::size_t> own, std::span<const std::size_t> unit,
                         std::size_t row, std::size_t winner, double probability) {
  const Rows rows{own, unit};
  const std::vector<double> to_trial =
      scaled_distances(rule.trial, profile.deviation, rule.trial.row(row));
  std::size_t nearest = row;
  for (std::size_t j = 0; j < to_trial.size(); ++j)
    if (unit[j] != unit[row] && (nearest == row || to_trial[j] < to_trial[nearest])) nearest = j;
  double radius = compute_radius(rule.trial, profile.deviation, rows, nearest, unit[row]);
  if (!usable(radius)) radius = rule.radius[nearest];
  double to_mean =
      winner == own[row] ? distance_to_rest(rule.trial, profile.deviation, rows, row) : infinite;
  if (std::isinf(to_mean))
    to_mean = scaled_distances(profile.mean, profile.deviation, rule.trial.row(row))[winner];
  return {over(to_trial[nearest], radius), over(to_mean, rule.spread[winner]), 1.0 - probability};
}

double upper_threshold(std::vector<double> scores, double share) {
  if (scores.empty()) return infinite;
  std::sort(scores.begin(), scores.end());
  const auto count = static_cast<double>(scores.size());
  const double place = std::ceil((count + 1.0) * (1.0 - share) - 1e-9);  // 95.00000000000001 is 95
  return scores[static_cast<std::size_t>(std::clamp(place, 1.0, count)) - 1];
}

}  // namespace weft::classifier
