#include "classifier/learn/svm_solver.hpp"

#include <algorithm>
#include <cmath>

namespace weft::classifier {
namespace {

bool usable(double v) {
  return v > 0.0 && std::isfinite(v);
}

}  // namespace

SvmSolver::SvmSolver(std::span<const int> sign, bool dense)
    : sign_(sign.begin(), sign.end()), dense_(dense && sign.size() <= most_dense_rows) {
  if (dense_) smo_.set_rows(sign_);
}

Status SvmSolver::set_kernel(const Matrix& kernel) {
  kernel_ = &kernel;
  libsvm_has_kernel_ = false;
  if (!dense_) return {};
  const auto& all = kernel.data();
  const std::size_t n = sign_.size();
  const bool finite =
      std::all_of(all.begin(), all.end(), [](double v) { return std::isfinite(v); });
  const bool two_classes =
      std::any_of(sign_.begin(), sign_.end(), [&](int s) { return (s > 0) != (sign_[0] > 0); });
  // What is wrong is said by the reference.
  if (kernel.rows() != n || kernel.cols() != n || !finite || !two_classes)
    return SvmTrainer(sign_).set_kernel(kernel);
  smo_.set_kernel(kernel.row(0).data(), kernel.cols());
  return {};
}

Status SvmSolver::solve(double c, double tolerance) {
  if (!dense_ || kernel_ == nullptr || !usable(c) || !usable(tolerance) ||
      !smo_.solve(c, tolerance))
    return solve_with_libsvm(c, tolerance);
  coefficient_ = smo_.coefficient();
  bias_ = smo_.bias();
  holds_ = smo_.holds_for_larger_c();
  return {};
}

Status SvmSolver::solve_with_libsvm(double c, double tolerance) {
  if (!libsvm_) libsvm_.emplace(sign_);
  if (kernel_ != nullptr && !libsvm_has_kernel_) {
    if (auto ok = libsvm_->set_kernel(*kernel_); !ok) return ok;
    libsvm_has_kernel_ = true;
  }
  auto solved = libsvm_->solve(c, tolerance);
  if (!solved) return pass(solved.error());
  solution_ = std::move(*solved);
  coefficient_ = solution_.coefficient;
  bias_ = solution_.bias;
  holds_ = false;
  return {};
}

}  // namespace weft::classifier
