#include "classifier/vote/class_profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "classifier/learn/scaler.hpp"

namespace weft::classifier {
namespace {

// Means by sums of value / count: values up to 1e300 must not overflow.
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
    // what is left of a constant is the rounding of its values and of its mean
    if (!(largest > 1e-12 * top)) out[k] = overall[k];
    // one over a subnormal number would be infinite, and so every distance
    if (!(out[k] >= std::numeric_limits<double>::min() && std::isfinite(out[k]))) out[k] = 1.0;
  }
  return out;
}

// Four sums side by side: one would wait for each addition in turn.
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

Result<std::vector<std::size_t>> class_numbers(const FeatureMatrix& matrix,
                                               std::span<const std::string> labels) {
  std::vector<std::size_t> out;
  out.reserve(matrix.size());
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    const auto at = std::lower_bound(labels.begin(), labels.end(), matrix.labels[r]);
    if (at == labels.end() || *at != matrix.labels[r])
      return fail({.code = Errc::invalid_argument,
                   .where = matrix.files[r],
                   .what = "label is not one of the model's",
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
                   .what = "no training row",
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
    // zero times infinity, of a deviation at the end of double
    out[r] = std::isnan(sum) ? std::numeric_limits<double>::infinity() : sum;
  }
  return out;
}

std::vector<std::size_t> nearest_classes(const ClassProfile& profile,
                                         std::span<const double> features, std::size_t count) {
  const std::vector<double> distance = scaled_distances(profile.mean, profile.deviation, features);
  std::vector<std::size_t> order(distance.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(std::min(count, order.size()));
  std::partial_sort(order.begin(), end, order.end(), [&](std::size_t a, std::size_t b) {
    return distance[a] != distance[b] ? distance[a] < distance[b] : a < b;
  });
  order.erase(end, order.end());
  std::sort(order.begin(), order.end());
  return order;
}

}  // namespace weft::classifier
