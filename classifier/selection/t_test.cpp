#include "classifier/selection/t_test.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "classifier/selection/student_t.hpp"

namespace weft::classifier {
namespace {

// Means and sums of squares of one class, per column.
struct ClassSums {
  std::vector<double> mean;
  std::vector<double> square;  // about the mean
  double count = 0.0;
};

// 2^-e per column such that the largest magnitude is near 1: exact, and squares cannot overflow.
std::vector<double> column_scales(const Matrix& rows) {
  std::vector<double> top(rows.cols(), 0.0);
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    for (std::size_t k = 0; k < rows.cols(); ++k) top[k] = std::max(top[k], std::abs(rows(r, k)));
  }
  for (double& v : top)
    v = v > 0.0 ? std::ldexp(1.0, std::clamp(-std::ilogb(v), -1022, 1022)) : 1.0;
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

std::vector<std::size_t> rank_by_t(std::span<const double> t) {
  std::vector<std::size_t> order(t.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [t](std::size_t a, std::size_t b) {
    const double ta = std::abs(t[a]);
    const double tb = std::abs(t[b]);
    return ta != tb ? ta > tb : a < b;
  });
  return order;
}

std::size_t subset_size(std::span<const double> t, std::span<const std::size_t> ranked, double df,
                        double delta, std::size_t cap) {
  std::size_t size = 0;
  const std::size_t most = std::min(cap, ranked.size());
  while (size < most && two_sided_p(t[ranked[size]], df) < delta) ++size;
  return std::max<std::size_t>(size, 1);
}

}  // namespace weft::classifier
