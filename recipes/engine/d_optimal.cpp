// D-optimal choice of the cells of a sweep; declared in sweep.hpp.

#include "recipes/engine/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "protocols/base/result.hpp"

namespace weft::recipes {
namespace {

using Row = std::vector<double>;

/// Least improvement that counts: rounding must not decide between equal designs.
constexpr double clearly_better = 1e-9;
/// Each pass checks every chosen row once; a few passes are enough in practice.
constexpr std::size_t most_passes = 20;
/// Added to the information matrix before any row is chosen, so that it has an inverse.
constexpr double ridge = 1e-6;

double scaled(const Factor& factor, std::size_t level) {
  const auto [least, most] = std::minmax_element(factor.values.begin(), factor.values.end());
  return *most == *least ? 0 : 2 * (factor.values[level] - *least) / (*most - *least) - 1;
}

double dot(const Row& a, const Row& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// The inverse of the information matrix sum x x', updated as rows are added and removed (Sherman
/// and Morrison 1950).
class Information {
 public:
  explicit Information(std::size_t terms) : inverse_(terms, Row(terms, 0.0)) {
    for (std::size_t i = 0; i < terms; ++i) inverse_[i][i] = 1 / ridge;
  }

  [[nodiscard]] Row times(const Row& x) const {
    Row out;
    out.reserve(x.size());
    for (const Row& line : inverse_) out.push_back(dot(line, x));
    return out;
  }
  /// Variance of the prediction at x, in units of the noise variance.
  [[nodiscard]] double variance(const Row& x) const { return dot(x, times(x)); }

  void add(const Row& x, double sign) {
    const Row u = times(x);
    const double scale = sign / (1 + sign * dot(x, u));
    for (std::size_t i = 0; i < u.size(); ++i)
      for (std::size_t k = 0; k < u.size(); ++k) inverse_[i][k] -= scale * u[i] * u[k];
  }

 private:
  std::vector<Row> inverse_;
};

/// log |X'X / rows| by Cholesky; -infinity without full rank.
double log_determinant(const std::vector<Row>& rows, const std::vector<std::size_t>& chosen) {
  const std::size_t p = rows.front().size();
  std::vector<Row> m(p, Row(p, 0.0));
  for (const std::size_t r : chosen)
    for (std::size_t i = 0; i < p; ++i)
      for (std::size_t k = 0; k <= i; ++k)
        m[i][k] += rows[r][i] * rows[r][k] / static_cast<double>(chosen.size());
  double sum = 0;
  for (std::size_t i = 0; i < p; ++i)
    for (std::size_t k = 0; k <= i; ++k) {
      for (std::size_t j = 0; j < k; ++j) m[i][k] -= m[i][j] * m[k][j];
      if (k < i) {
        m[i][k] /= m[k][k];
      } else {
        if (!(m[i][i] > clearly_better)) return -HUGE_VAL;
        m[i][i] = std::sqrt(m[i][i]);
        sum += 2 * std::log(m[i][i]);
      }
    }
  return sum;
}

class Exchange {
 public:
  Exchange(const std::vector<Row>& rows, std::size_t count)
      : rows_(rows), chosen_(rows.size(), false), information_(rows.front().size()) {
    for (std::size_t i = 0; i < count; ++i) take(least_known());
  }

  /// Swaps each row in turn for the unchosen one that raises the determinant most.
  void improve() {
    for (std::size_t pass = 0; pass < most_passes; ++pass) {
      bool better = false;
      for (std::size_t in = 0; in < rows_.size(); ++in)
        if (chosen_[in]) better = swap_for_better(in) || better;
      if (!better) return;
    }
  }

  [[nodiscard]] std::vector<std::size_t> chosen() const {
    std::vector<std::size_t> out;
    for (std::size_t i = 0; i < rows_.size(); ++i)
      if (chosen_[i]) out.push_back(i);
    return out;
  }

 private:
  void take(std::size_t row) {
    chosen_[row] = true;
    information_.add(rows_[row], 1);
  }

  [[nodiscard]] std::size_t least_known() const {
    std::size_t best = rows_.size();
    double most = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (chosen_[i]) continue;
      const double variance = information_.variance(rows_[i]);
      if (best < rows_.size() && variance <= most * (1 + clearly_better)) continue;
      best = i;
      most = variance;
    }
    return best;
  }

  /// |M - a a' + b b'| / |M| = (1 + d_b)(1 - d_a) + d_ab^2.
  bool swap_for_better(std::size_t in) {
    const Row u = information_.times(rows_[in]);
    const double own = dot(rows_[in], u);
    std::size_t best = in;
    double most = 1 + clearly_better;
    for (std::size_t out = 0; out < rows_.size(); ++out) {
      if (chosen_[out]) continue;
      const double both = dot(rows_[out], u);
      const double ratio = (1 + information_.variance(rows_[out])) * (1 - own) + both * both;
      if (ratio <= most) continue;
      most = ratio * (1 + clearly_better);
      best = out;
    }
    if (best == in) return false;
    take(best);
    chosen_[in] = false;
    information_.add(rows_[in], -1);
    return true;
  }

  const std::vector<Row>& rows_;
  std::vector<bool> chosen_;
  Information information_;
};

}  // namespace

std::vector<Row> model_rows(const std::vector<Factor>& factors, SweepModel model) {
  std::vector<Row> rows{Row{}};
  for (const Factor& factor : factors) {
    std::vector<Row> longer;
    for (const Row& row : rows)
      for (std::size_t level = 0; level < factor.values.size(); ++level) {
        longer.push_back(row);
        longer.back().push_back(scaled(factor, level));
      }
    rows = std::move(longer);
  }
  for (Row& row : rows) {
    const Row x = std::move(row);
    row = {1};
    for (std::size_t i = 0; i < factors.size(); ++i)
      if (factors[i].values.size() > 1) row.push_back(x[i]);
    if (model == SweepModel::linear) continue;
    for (std::size_t i = 0; i < factors.size(); ++i)
      for (std::size_t k = i; k < factors.size(); ++k) {
        const std::size_t needed = i == k ? 3 : 2;
        if (std::min(factors[i].values.size(), factors[k].values.size()) >= needed)
          row.push_back(x[i] * x[k]);
      }
  }
  return rows;
}

Subset d_optimal(const std::vector<Row>& rows, std::size_t count) {
  WEFT_ASSERT(!rows.empty() && count >= rows.front().size() && count <= rows.size());
  std::vector<std::size_t> all(rows.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  Subset out;
  if (count == rows.size()) {
    out.rows = all;
  } else {
    Exchange exchange(rows, count);
    exchange.improve();
    out.rows = exchange.chosen();
  }
  out.d_efficiency = std::exp((log_determinant(rows, out.rows) - log_determinant(rows, all)) /
                              static_cast<double>(rows.front().size()));
  return out;
}

}  // namespace weft::recipes
