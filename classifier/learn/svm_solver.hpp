#pragma once
// Squared distances and the radial basis function on them, and two solvers with one interface: our
// own for small dense problems, libsvm for everything else.

#include <cstddef>
#include <optional>
#include <span>

#include "classifier/base/matrix.hpp"
#include "classifier/learn/dense_smo.hpp"
#include "classifier/learn/svm.hpp"

namespace weft::classifier {

// Squared distances that grow column by column, and the radial basis function on them.

/// value -> exp(-factor value) for factor >= 0 and values >= 0, in place. The error is at most 2
/// units in the last place; results below 2^-1021 are 0. NaN stays NaN. The same on every processor
/// and compiler.
void exp_of_negative(std::span<double> values, double factor);

/// Adds to `squared` [a rows x n] the squared differences of columns from <= k < to, between the
/// rows of a and the first n rows of b. Subtracts first, then squares: a^2 + b^2 - 2ab loses digits
/// and can be negative.
void add_squared_distances(const Matrix& a, const Matrix& b, std::size_t from, std::size_t to,
                           Matrix& squared);

/// exp(-gamma d), element by element.
Matrix rbf(const Matrix& squared, double gamma);
/// The same into `out`; reuses its memory where possible.
void rbf(const Matrix& squared, double gamma, Matrix& out);

/// Trains on one set of rows with several kernels and several C. One object per thread.
class SvmSolver {
 public:
  /// Largest problem for the dense solver: its kernel is then 2 MiB.
  static constexpr std::size_t most_dense_rows = 512;

  SvmSolver() = default;
  /// The dense solver gives up after `step_limit` steps.
  explicit SvmSolver(std::size_t step_limit) : step_limit_(step_limit) {}
  /// The same arguments as set_rows().
  SvmSolver(std::span<const int> sign, bool dense) { set_rows(sign, dense); }

  /// `sign`: +1 or -1 per training row; both must occur. `dense` false: always libsvm. Costs
  /// nothing if nothing changes.
  void set_rows(std::span<const int> sign, bool dense);

  /// [n x n] kernel between the training rows; kept by reference until the next call. Further rows
  /// are not read. Errors as SvmTrainer::set_kernel.
  Status set_kernel(const Matrix& kernel);

  /// Uses the dense solver, and libsvm if that does not converge. Errors as SvmTrainer::solve.
  Status solve(double c, double tolerance);

  [[nodiscard]] std::span<const double> coefficient() const { return coefficient_; }
  [[nodiscard]] double bias() const { return bias_; }
  /// False: libsvm gave up at its limit of iterations; the result is only its last state.
  [[nodiscard]] bool converged() const { return converged_; }
  /// True if libsvm found the solution.
  [[nodiscard]] bool by_libsvm() const { return by_libsvm_; }
  /// True if every larger C has the same solution.
  [[nodiscard]] bool holds_for_larger_c() const { return holds_; }

 private:
  Status solve_with_libsvm(double c, double tolerance);
  Status give_libsvm_the_kernel();

  std::vector<int> sign_;
  bool two_classes_ = false;
  bool dense_ = false;
  const Matrix* kernel_ = nullptr;
  DenseSmo smo_;
  std::optional<SvmTrainer> libsvm_;  // made on first use
  bool libsvm_has_kernel_ = false;
  SvmSolution solution_;  // solution of libsvm
  std::span<const double> coefficient_;
  double bias_ = 0.0;
  bool holds_ = false;
  bool converged_ = true;
  bool by_libsvm_ = false;
  std::size_t step_limit_ = DenseSmo::most_steps;
};

}  // namespace weft::classifier
