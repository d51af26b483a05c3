#include "classifier/vote/novelty.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "classifier/base/parallel.hpp"
#include "classifier/learn/feature_view.hpp"
#include "protocols/base/names.hpp"

namespace weft::classifier {
namespace {

constexpr NameTable<RejectKind, reject_kinds> kind_names = {{
    {RejectKind::neighbour, "neighbour"},
    {RejectKind::class_mean, "class_mean"},
    {RejectKind::probability, "probability"},
}};
constexpr double infinite = std::numeric_limits<double>::infinity();

// Class and unit of each row.
struct Rows {
  std::span<const std::size_t> own;
  std::span<const std::size_t> unit;
};

// Distance of row `at` to the nearest row of its class with a unit other than its own and
// `without`; infinite if there is none.
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

// Replaces unusable lengths by the mean of their class, by that of all, or by 1.
void fill_unusable(std::vector<double>& lengths, std::span<const std::size_t> own,
                   std::size_t classes) {
  std::vector<std::vector<double>> of_class(classes);
  for (std::size_t r = 0; r < lengths.size(); ++r) of_class[own[r]].push_back(lengths[r]);
  const double all = mean_of_usable(lengths, 1.0);
  for (std::size_t r = 0; r < lengths.size(); ++r)
    if (!usable(lengths[r])) lengths[r] = mean_of_usable(of_class[own[r]], all);
}

// Distance of row `at` to the mean of its class without its unit; infinite if no row remains.
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

// Means as sums of value / count: values up to 1e300 must not overflow.
Matrix class_means(const FeatureMatrix& matrix, std::span<const std::size_t> of_row,
                   std::span<const std::size_t> count) {
  Matrix out(count.size(), matrix.values.cols());
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    const auto n = static_cast<double>(count[of_row[r]]);
    for (std::size_t k = 0; k < out.cols(); ++k) out(of_row[r], k) += matrix.values(r, k) / n;
  }
  return out;
}

std::vector<double> deviations(const FeatureMatrix& matrix, std::span<const std::size_t> of_row,
                               const Matrix& mean) {
  Matrix residual = matrix.values;
  for (std::size_t r = 0; r < residual.rows(); ++r)
    for (std::size_t k = 0; k < residual.cols(); ++k) residual(r, k) -= mean(of_row[r], k);
  std::vector<double> out = fit_scaler(residual).deviation;
  const std::vector<double> overall = fit_scaler(matrix.values).deviation;
  for (std::size_t k = 0; k < out.size(); ++k) {
    double largest = 0.0, top = overall[k];
    for (std::size_t r = 0; r < residual.rows(); ++r) {
      largest = std::max(largest, std::abs(residual(r, k)));
      top = std::max(top, std::abs(matrix.values(r, k)));
    }
    // The rest of a constant is the rounding of its values and of its mean.
    if (!(largest > 1e-12 * top)) out[k] = overall[k];
    // The inverse of a subnormal number would be infinite, and so every distance.
    if (!(out[k] >= std::numeric_limits<double>::min() && std::isfinite(out[k]))) out[k] = 1.0;
  }
  return out;
}

// Four parallel sums: a single one would wait for each addition.
double weighted_l1(std::span<const double> a, std::span<const double> b,
                   std::span<const double> weight) {
  std::array<double, 4> sum{};
  std::size_t k = 0;
  for (; k + 4 <= a.size(); k += 4)
    for (std::size_t lane = 0; lane < 4; ++lane)
      sum[lane] += std::abs(a[k + lane] - b[k + lane]) * weight[k + lane];
  for (; k < a.size(); ++k) sum[0] += std::abs(a[k] - b[k]) * weight[k];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
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

Result<std::vector<std::size_t>> class_numbers(const FeatureMatrix& matrix,
                                               std::span<const std::string> labels) {
  std::vector<std::size_t> out;
  out.reserve(matrix.size());
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    const auto at = std::lower_bound(labels.begin(), labels.end(), matrix.labels[r]);
    if (at == labels.end() || *at != matrix.labels[r])
      return fail({.code = Errc::invalid_argument,
                   .where = matrix.files[r],
                   .what = "label not in the model",
                   .got = matrix.labels[r]});
    out.push_back(static_cast<std::size_t>(at - labels.begin()));
  }
  return out;
}

Result<ClassProfile> fit_profile(const FeatureMatrix& matrix, std::span<const std::string> labels) {
  if (auto ok = check(matrix); !ok) return pass(ok.error());
  const auto of_row = class_numbers(matrix, labels);
  if (!of_row) return pass(of_row.error());
  std::vector<std::size_t> count(labels.size());
  for (const std::size_t c : *of_row) ++count[c];
  for (std::size_t c = 0; c < count.size(); ++c)
    if (count[c] == 0)
      return fail({.code = Errc::invalid_argument,
                   .where = "label " + labels[c],
                   .what = "label without training rows",
                   .expected = "at least 1"});
  Matrix mean = class_means(matrix, *of_row, count);
  std::vector<double> deviation = deviations(matrix, *of_row, mean);
  return ClassProfile{std::move(mean), std::move(deviation)};
}

std::vector<double> scaled_distances(const Matrix& points, std::span<const double> deviation,
                                     std::span<const double> features) {
  WEFT_ASSERT(features.size() == points.cols() && features.size() == deviation.size());
  std::vector<double> weight(features.size());
  for (std::size_t k = 0; k < weight.size(); ++k)
    weight[k] = 1.0 / (deviation[k] * static_cast<double>(weight.size()));
  std::vector<double> out(points.rows());
  for (std::size_t r = 0; r < out.size(); ++r) {
    const double sum = weighted_l1(points.row(r), features, weight);
    // zero times infinity, from a deviation at the limit of double
    out[r] = std::isnan(sum) ? std::numeric_limits<double>::infinity() : sum;
  }
  return out;
}

std::vector<std::size_t> nearest_classes(const ClassProfile& profile,
                                         std::span<const double> features, std::size_t count) {
  const std::vector<double> distance = scaled_distances(profile.mean, profile.deviation, features);
  std::vector<std::size_t> order = numbers_below(distance.size());
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(std::min(count, order.size()));
  std::partial_sort(order.begin(), end, order.end(), [&](std::size_t a, std::size_t b) {
    return distance[a] != distance[b] ? distance[a] < distance[b] : a < b;
  });
  order.erase(end, order.end());
  std::sort(order.begin(), order.end());
  return order;
}

}  // namespace weft::classifier
