#include "classifier/selection/selection.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "classifier/base/lanes.hpp"

namespace weft::classifier {
namespace {

using simd::all;
using simd::Lanes;
using simd::larger;
using simd::load;
using simd::magnitude;
using simd::store;

// The same function names for one column as for eight.
WEFT_INLINE double larger(double a, double b) {
  return a > b ? a : b;
}
WEFT_INLINE double magnitude(double a) {
  return larger(a, -a);
}
template <class V>
WEFT_INLINE V columns_at(const double* p) {
  if constexpr (std::is_same_v<V, double>)
    return *p;
  else
    return load(p);
}

using LaneBits = std::uint64_t __attribute__((vector_size(sizeof(Lanes))));

// A power of two near 1 / v, made from the exponent bits; 1 for 0. Range 2^-1022 to 2^1022.
template <class V>
WEFT_INLINE V inverse_power_of_two(V v) {
  using Bits = std::conditional_t<std::is_same_v<V, double>, std::uint64_t, LaneBits>;
  constexpr std::uint64_t bias = 1023;
  const Bits raw = std::bit_cast<Bits>(v) >> 52;
  const Bits low = raw < 1 ? raw + 1 : raw;
  const Bits exponent = low > 2 * bias - 1 ? low - low + (2 * bias - 1) : low;
  return v > 0.0 ? std::bit_cast<V>((2 * bias - exponent) << 52) : V{} + 1.0;
}

// Rows of one class.
using Rows = std::vector<const double*>;

// Mean and sum of squares about it, for columns scaled to about 1 by `scale`.
template <class V>
struct Sums {
  V mean{}, square{};
};

template <class V>
WEFT_INLINE Sums<V> sums_of(const Rows& rows, std::size_t column, V scale) {
  Sums<V> out;
  for (const double* row : rows) out.mean += columns_at<V>(row + column) * scale;
  out.mean /= static_cast<double>(rows.size());
  for (const double* row : rows) {
    const V d = columns_at<V>(row + column) * scale - out.mean;
    out.square += d * d;
  }
  return out;
}

// A power of two scales the largest magnitude to about 1: this is exact, and squares cannot
// overflow.
template <class V>
WEFT_INLINE V scale_of(const Rows& x, const Rows& y, std::size_t column) {
  V top{};
  for (const Rows* rows : {&x, &y})
    for (const double* row : *rows) top = larger(magnitude(columns_at<V>(row + column)), top);
  return inverse_power_of_two(top);
}

// The least deviation above rounding (AMB-13).
template <class V>
WEFT_INLINE V floor_of(const Sums<V>& a, const Sums<V>& b) {
  return 1e-9 * larger(magnitude(a.mean), magnitude(b.mean));
}

// The difference of the means and the square of its standard error.
template <class V>
WEFT_INLINE void compare(const Rows& x, const Rows& y, std::size_t column, V& difference,
                         V& error) {
  const V scale = scale_of<V>(x, y, column);
  const Sums<V> a = sums_of(x, column, scale), b = sums_of(y, column, scale);
  const auto n = static_cast<double>(x.size()), m = static_cast<double>(y.size());
  const V floor = floor_of(a, b);
  const V pooled = (a.square + b.square) / (n + m - 2.0);
  difference = a.mean - b.mean;
  error = larger(floor * floor, pooled) * (1.0 / n + 1.0 / m);
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void compare_columns(const Rows& x, const Rows& y, std::size_t columns, double* difference,
                     double* error) {
  std::size_t k = 0;
  for (; k + simd::width <= columns; k += simd::width) {
    Lanes d, e;
    compare<Lanes>(x, y, k, d, e);
    store(difference + k, d);
    store(error + k, e);
  }
  for (; k < columns; ++k) compare<double>(x, y, k, difference[k], error[k]);
}

// Welch's t of one column and its degrees of freedom. On entry `t` and `df` have those of the
// pooled test; they stay if a variance is unknown or both are only rounding.
void compare_unpooled(const Rows& x, const Rows& y, std::size_t column, double& t, double& df) {
  if (x.size() < 2 || y.size() < 2) return;
  const auto scale = scale_of<double>(x, y, column);
  const Sums<double> a = sums_of(x, column, scale), b = sums_of(y, column, scale);
  const auto n = static_cast<double>(x.size()), m = static_cast<double>(y.size());
  const double of_x = a.square / (n - 1.0) / n, of_y = b.square / (m - 1.0) / m;
  const double error = of_x + of_y, floor = floor_of(a, b);
  if (!(error > floor * floor * (1.0 / n + 1.0 / m))) return;
  t = (a.mean - b.mean) / std::sqrt(error);
  const double share_x = of_x / error, share_y = of_y / error;
  df = 1.0 / (share_x * share_x / (n - 1.0) + share_y * share_y / (m - 1.0));
}

Rows rows_of(const Matrix& rows, std::span<const std::size_t> which, std::span<const int> sign,
             bool positive) {
  Rows out;
  for (const std::size_t r : which)
    if ((sign[r] > 0) == positive) out.push_back(rows.row(r).data());
  return out;
}

// Up to this many columns are ranked by insertion; most columns of a long list are not inserted.
constexpr std::size_t few = 64;

std::vector<std::size_t> rank_many(std::span<const double> t, std::size_t retained) {
  std::vector<std::pair<double, std::size_t>> merit;  // -|t| and column: smallest first
  merit.reserve(t.size());
  for (std::size_t k = 0; k < t.size(); ++k) merit.emplace_back(-std::abs(t[k]), k);
  std::partial_sort(merit.begin(), merit.begin() + static_cast<std::ptrdiff_t>(retained),
                    merit.end());
  std::vector<std::size_t> order(retained);
  for (std::size_t k = 0; k < retained; ++k) order[k] = merit[k].second;
  return order;
}

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using View = Eigen::Map<const RowMajor>;

// Squares of the singular values, descending, and the right singular vectors as columns.
struct Spectrum {
  Eigen::VectorXd square;
  Eigen::MatrixXd right;
};

// Uses the smaller of Z Z' and Z' Z: with 16 trials of 195 features the 16 x 16 one costs almost
// nothing.
Spectrum decompose(const View& z) {
  const bool wide = z.cols() > z.rows();
  const Eigen::MatrixXd gram = wide ? Eigen::MatrixXd(z * z.transpose()) : z.transpose() * z;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
  Spectrum out;
  out.square = solver.eigenvalues().reverse().cwiseMax(0.0);
  const Eigen::MatrixXd vectors = solver.eigenvectors().rowwise().reverse();
  out.right = wide ? Eigen::MatrixXd(z.transpose() * vectors) : vectors;
  return out;
}

void store_axis(const Eigen::VectorXd& direction, Matrix& axes, std::size_t row) {
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  const double sign = direction(largest) < 0.0 ? -1.0 : 1.0;
  const Eigen::VectorXd unit = direction.normalized() * sign;
  std::copy(unit.data(), unit.data() + unit.size(), axes.row(row).begin());
}

}  // namespace

std::vector<double> t_statistics(const Matrix& rows, std::span<const std::size_t> which,
                                 std::span<const int> sign) {
  std::vector<double> t(rows.cols(), 0.0);
  if (which.size() < 3) return t;
  const Rows x = rows_of(rows, which, sign, true), y = rows_of(rows, which, sign, false);
  std::vector<double> error(rows.cols());
  compare_columns(x, y, rows.cols(), t.data(), error.data());
  for (std::size_t k = 0; k < t.size(); ++k)
    t[k] = error[k] > 0.0 ? t[k] / std::sqrt(error[k]) : 0.0;
  return t;
}

WelchTest welch_statistics(const Matrix& rows, std::span<const std::size_t> which,
                           std::span<const int> sign) {
  WelchTest out{t_statistics(rows, which, sign), {}, {}};
  out.df.assign(rows.cols(), static_cast<double>(which.size()) - 2.0);
  out.log_p.assign(rows.cols(), 0.0);
  if (which.size() < 3) return out;
  const Rows x = rows_of(rows, which, sign, true), y = rows_of(rows, which, sign, false);
  for (std::size_t k = 0; k < rows.cols(); ++k) {
    compare_unpooled(x, y, k, out.t[k], out.df[k]);
    out.log_p[k] = log_two_sided_p(out.t[k], out.df[k]);
  }
  return out;
}

std::vector<std::size_t> rank_by_t(std::span<const double> t, std::size_t most) {
  const std::size_t retained = std::min(most, t.size());
  if (retained > few) return rank_many(t, retained);
  std::array<double, few + 1> merit;  // |t|, descending
  std::vector<std::size_t> order(retained + 1);
  std::size_t have = 0;
  for (std::size_t k = 0; k < t.size(); ++k) {
    const double m = std::abs(t[k]);
    if (have == retained && (retained == 0 || !(m > merit[retained - 1]))) continue;
    std::size_t at = have;
    for (; at > 0 && m > merit[at - 1]; --at) merit[at] = merit[at - 1], order[at] = order[at - 1];
    merit[at] = m;
    order[at] = k;
    have = std::min(have + 1, retained);
  }
  order.resize(retained);
  return order;
}

std::size_t subset_size(std::span<const double> t, std::span<const std::size_t> ranked, double df,
                        double delta, std::size_t cap, const RareT& rare) {
  const RareT::Limit limit = rare.limit(delta, df);
  std::size_t size = 0;
  const std::size_t most = std::min(cap, ranked.size());
  while (size < most && limit.passed_by(t[ranked[size]])) ++size;
  return std::max<std::size_t>(size, 1);
}

std::size_t subset_size(std::span<const double> log_p, std::span<const std::size_t> ranked,
                        double delta, std::size_t cap) {
  std::size_t size = 0;
  const std::size_t most = std::min(cap, ranked.size());
  while (size < most && std::exp(log_p[ranked[size]]) < delta) ++size;
  return std::max<std::size_t>(size, 1);
}

PcaBasis pca_basis(const Matrix& rows, std::size_t cap) {
  const View z(rows.data().data(), static_cast<Eigen::Index>(rows.rows()),
               static_cast<Eigen::Index>(rows.cols()));
  const Spectrum s = decompose(z);
  const double total = s.square.sum();
  if (!(total > 0.0)) return {Matrix(1, rows.cols()), {1.0}};
  std::size_t retained = 0;
  const std::size_t most = std::min(cap, static_cast<std::size_t>(s.square.size()));
  while (retained < most && s.square(static_cast<Eigen::Index>(retained)) > 1e-14 * s.square(0))
    ++retained;
  PcaBasis out{Matrix(retained, rows.cols()), {}};
  double sum = 0.0;
  for (std::size_t k = 0; k < retained; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    store_axis(s.right.col(at), out.axes, k);
    sum += s.square(at);
    out.explained.push_back(sum / total);
  }
  return out;
}

std::size_t components_for(const PcaBasis& basis, double share) {
  const auto enough =
      std::lower_bound(basis.explained.begin(), basis.explained.end(), share - 1e-12);
  const auto count = static_cast<std::size_t>(enough - basis.explained.begin()) + 1;
  return std::min(count, basis.explained.size());
}

}  // namespace weft::classifier
