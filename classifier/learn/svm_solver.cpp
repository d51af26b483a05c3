#include "classifier/learn/svm_solver.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace weft::classifier {
namespace {

bool usable(double v) {
  return v > 0.0 && std::isfinite(v);
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
  return give_libsvm_the_kernel();  // which says what is wrong
}

Status SvmSolver::give_libsvm_the_kernel() {
  if (!libsvm_) libsvm_.emplace(sign_);
  const std::size_t n = sign_.size();
  if (kernel_->rows() <= n || kernel_->cols() != n) return libsvm_->set_kernel(*kernel_);
  std::vector<std::size_t> first(n);
  std::iota(first.begin(), first.end(), std::size_t{0});
  return libsvm_->set_kernel(kernel_->take(first));
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

}  // namespace weft::classifier
