#include "classifier/learn/svm_solver.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "classifier/base/lanes.hpp"
#include "classifier/learn/block.hpp"

namespace weft::classifier {
namespace {

bool usable(double v) {
  return v > 0.0 && std::isfinite(v);
}

using simd::Lanes;

// Columns from <= k < to of the first n rows of b as rows of `width` values; the padding is zero.
void transpose(const Matrix& b, std::size_t from, std::size_t to, std::size_t n, std::size_t width,
               std::vector<double>& out) {
  out.assign((to - from) * width, 0.0);
  for (std::size_t j = 0; j < n; ++j) {
    const double* row = b.row(j).data();
    for (std::size_t k = from; k < to; ++k) out[(k - from) * width + j] = row[k];
  }
}

// Eight sums at a time stay in registers; the columns are added in their order.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void add_row(const double* row, const double* columns, std::size_t count, std::size_t width,
             double* sums) {
  for (std::size_t j = 0; j < width; j += simd::width) {
    Lanes sum = simd::load(sums + j);
    for (std::size_t k = 0; k < count; ++k) {
      const Lanes d = row[k] - simd::load(columns + k * width + j);
      sum += d * d;
    }
    simd::store(sums + j, sum);
  }
}

}  // namespace

void SvmSolver::set_rows(std::span<const int> sign, bool dense) {
  const bool now_dense = dense && sign.size() <= most_dense_rows;
  if (std::ranges::equal(sign, sign_) && now_dense == dense_) return;
  sign_.assign(sign.begin(), sign.end());
  dense_ = now_dense;
  two_classes_ =
      std::any_of(sign.begin(), sign.end(), [&](int s) { return (s > 0) != (sign[0] > 0); });
  kernel_ = nullptr;
  libsvm_.reset();
  if (dense_) smo_.set_rows(sign_);
}

Status SvmSolver::set_kernel(const Matrix& kernel) {
  kernel_ = &kernel;
  libsvm_has_kernel_ = false;
  if (!dense_) return {};
  const std::size_t n = sign_.size();
  const bool usable_size = kernel.rows() >= n && kernel.cols() == n;
  if (usable_size && two_classes_ && smo_.set_kernel(kernel.row(0).data(), n)) return {};
  return give_libsvm_the_kernel();  // it reports the error
}

Status SvmSolver::give_libsvm_the_kernel() {
  if (!libsvm_) libsvm_.emplace(sign_);
  const std::size_t n = sign_.size();
  if (kernel_->rows() <= n || kernel_->cols() != n) return libsvm_->set_kernel(*kernel_);
  return libsvm_->set_kernel(kernel_->take(numbers_below(n)));
}

Status SvmSolver::solve(double c, double tolerance) {
  if (!dense_ || kernel_ == nullptr || !usable(c) || !usable(tolerance) ||
      !smo_.solve(c, tolerance, step_limit_))
    return solve_with_libsvm(c, tolerance);
  coefficient_ = smo_.coefficient();
  bias_ = smo_.bias();
  holds_ = smo_.holds_for_larger_c();
  converged_ = true;
  by_libsvm_ = false;
  return {};
}

Status SvmSolver::solve_with_libsvm(double c, double tolerance) {
  if (!libsvm_) libsvm_.emplace(sign_);
  if (kernel_ != nullptr && !libsvm_has_kernel_) {
    if (auto ok = give_libsvm_the_kernel(); !ok) return ok;
    libsvm_has_kernel_ = true;
  }
  auto solved = libsvm_->solve(c, tolerance);
  if (!solved) return pass(solved.error());
  solution_ = std::move(*solved);
  coefficient_ = solution_.coefficient;
  bias_ = solution_.bias;
  holds_ = false;
  converged_ = solution_.converged;
  by_libsvm_ = true;
  return {};
}

void add_squared_distances(const Matrix& a, const Matrix& b, std::size_t from, std::size_t to,
                           Matrix& squared) {
  const std::size_t n = squared.cols();
  const std::size_t width = (n + simd::width - 1) / simd::width * simd::width;
  std::vector<double> columns, sums(width);
  transpose(b, from, to, n, width, columns);
  for (std::size_t i = 0; i < a.rows(); ++i) {
    const auto out = squared.row(i);
    std::copy(out.begin(), out.end(), sums.begin());
    add_row(a.row(i).data() + from, columns.data(), to - from, width, sums.data());
    std::copy_n(sums.begin(), n, out.begin());
  }
}

void rbf(const Matrix& squared, double gamma, Matrix& out) {
  out = squared;
  exp_of_negative(out.data(), gamma);
}

Matrix rbf(const Matrix& squared, double gamma) {
  Matrix out;
  rbf(squared, gamma, out);
  return out;
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void exp_of_negative(std::span<double> values, double factor) {
  const std::size_t whole = values.size() / simd::width * simd::width;
  for (std::size_t i = 0; i < whole; i += simd::width)
    simd::store(&values[i], exp_block(simd::load(&values[i]) * -factor));
  if (whole == values.size()) return;
  double rest[simd::width] = {};
  std::copy(values.begin() + static_cast<std::ptrdiff_t>(whole), values.end(), rest);
  simd::store(rest, exp_block(simd::load(rest) * -factor));
  std::copy_n(rest, values.size() - whole, values.begin() + static_cast<std::ptrdiff_t>(whole));
}

}  // namespace weft::classifier
