#include "classifier/selection/t_test.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace weft::classifier {
namespace {

// Means and sums of squares of one class, per column.
struct ClassSums {
  std::vector<double> mean;
  std::vector<double> square;  // about the mean
  double count = 0.0;
};

// The power of two next to 1 / v, made from the exponent bits; 1 for 0. Between 2^-1022 and 2^1022.
double inverse_power_of_two(double v) {
  if (!(v > 0.0)) return 1.0;
  constexpr std::uint64_t bias = 1023;
  const std::uint64_t exponent =
      std::clamp<std::uint64_t>(std::bit_cast<std::uint64_t>(v) >> 52, 1, 2 * bias - 1);
  return std::bit_cast<double>((2 * bias - exponent) << 52);
}

// 2^-e per column such that the largest magnitude is near 1: exact, and squares cannot overflow.
std::vector<double> column_scales(const Matrix& rows) {
  std::vector<double> top(rows.cols(), 0.0);
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    for (std::size_t k = 0; k < rows.cols(); ++k) top[k] = std::max(top[k], std::abs(rows(r, k)));
  }
  for (double& v : top) v = inverse_power_of_two(v);
  return top;
}

ClassSums sums_of(const Matrix& rows, std::span<const int> sign, bool positive,
                  const std::vector<double>& scale) {
  ClassSums out{std::vector<double>(rows.cols()), std::vector<double>(rows.cols())};
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    if ((sign[r] > 0) != positive) continue;
    out.count += 1.0;
    for (std::size_t k = 0; k < rows.cols(); ++k) out.mean[k] += rows(r, k) * scale[k];
  }
  for (double& m : out.mean) m /= out.count;
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    if ((sign[r] > 0) != positive) continue;
    for (std::size_t k = 0; k < rows.cols(); ++k) {
      const double d = rows(r, k) * scale[k] - out.mean[k];
      out.square[k] += d * d;
    }
  }
  return out;
}

}  // namespace

std::vector<double> t_statistics(const Matrix& rows, std::span<const int> sign) {
  const std::vector<double> scale = column_scales(rows);
  const ClassSums x = sums_of(rows, sign, true, scale);
  const ClassSums y = sums_of(rows, sign, false, scale);
  const double per_mean = 1.0 / x.count + 1.0 / y.count;
  std::vector<double> t(rows.cols(), 0.0);
  if (x.count + y.count < 3.0) return t;
  for (std::size_t k = 0; k < t.size(); ++k) {
    const double floor = 1e-9 * std::max(std::abs(x.mean[k]), std::abs(y.mean[k]));
    const double pooled = (x.square[k] + y.square[k]) / (x.count + y.count - 2.0);
    const double error = std::sqrt(std::max(pooled, floor * floor) * per_mean);
    if (error > 0.0) t[k] = (x.mean[k] - y.mean[k]) / error;
  }
  return t;
}

std::vector<std::size_t> rank_by_t(std::span<const double> t, std::size_t most) {
  std::vector<std::size_t> order(t.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::size_t kept = std::min(most, order.size());
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(kept);
  std::partial_sort(order.begin(), end, order.end(), [t](std::size_t a, std::size_t b) {
    const double ta = std::abs(t[a]);
    const double tb = std::abs(t[b]);
    return ta != tb ? ta > tb : a < b;
  });
  order.resize(kept);
  return order;
}

std::size_t subset_size(std::span<const double> t, std::span<const std::size_t> ranked, double df,
                        double delta, std::size_t cap, const RareT& rare) {
  std::size_t size = 0;
  const std::size_t most = std::min(cap, ranked.size());
  while (size < most && rare(t[ranked[size]], df, delta)) ++size;
  return std::max<std::size_t>(size, 1);
}

}  // namespace weft::classifier
