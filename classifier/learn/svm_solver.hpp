#pragma once
// Squared distances and the radial basis function on them, and two solvers behind one interface:
// our own for small dense problems, libsvm for everything else.

#include <cstddef>
#include <optional>
#include <span>

#include "classifier/base/matrix.hpp"
#include "classifier/learn/dense_smo.hpp"
#include "classifier/learn/svm.hpp"

namespace weft::classifier {

// Squared distances that grow column by column, and the radial basis function on them.

/// value -> exp(-factor value) for factor >= 0 and values >= 0, in place. Within 2 units in the
/// last place of the true result; 0 where that is below 2^-1021. NaN stays NaN. The same on every
/// processor and compiler.
void exp_of_negative(std::span<double> values, double factor);

/// Adds to `squared` [a rows x n] the squared differences of columns from <= k < to, between the
/// rows of a and the first n rows of b. Differences first, then squares: a^2 + b^2 - 2ab loses
/// digits and can turn negative.
void add_squared_distances(const Matrix& a, const Matrix& b, std::size_t from, std::size_t to,
                           Matrix& squared);

/// exp(-gamma d), element by element.
Matrix rbf(const Matrix& squared, double gamma);
/// The same into `out`, which takes its size without a new allocation where it can.
void rbf(const Matrix& squared, double gamma, Matrix& out);

/// Trains on one set of rows with several kernels and several C. One object per thread.
class SvmSolver {
 public:
  /// Largest problem that the dense solver takes: its kernel is 2 MiB then.
  static constexpr std::size_t most_dense_rows = 512;

  SvmSolver() = default;
  /// The dense solver gives up after so many steps.
  explicit SvmSolver(std::size_t step_limit) : step_limit_(step_limit) {}
  /// As set_rows().
  SvmSolver(std::span<const int> sign, bool dense) { set_rows(sign, dense); }

  /// `sign`: +1 or -1 per training row; both must occur. `dense` false: libsvm always. Costs
  /// nothing where nothing changes.
  void set_rows(std::span<const int> sign, bool dense);

  /// [n x n] kernel between the training rows; kept by reference until the next one. Further rows
  /// are not read. Errors as SvmTrainer::set_kernel.
  Status set_kernel(const Matrix& kernel);

  /// The dense solver; libsvm where that does not converge. Errors as SvmTrainer::solve.
  Status solve(double c, double tolerance);

  [[nodiscard]] std::span<const double> coefficient() const { return coefficient_; }
  [[nodiscard]] double bias() const { return bias_; }
  /// False: libsvm itself gave up at its limit of iterations, so this is only the best it had.
  [[nodiscard]] bool converged() const { return converged_; }
  /// Who found it.
  [[nodiscard]] bool by_libsvm() const { return by_libsvm_; }
  /// This solution is also the one of every larger C.
  [[nodiscard]] bool holds_for_larger_c() const { return holds_; }

 private:
  Status solve_with_libsvm(double c, double tolerance);
  Status give_libsvm_the_kernel();

  std::vector<int> sign_;
  bool two_classes_ = false;
  bool dense_ = false;
  const Matrix* kernel_ = nullptr;
  DenseSmo smo_;
  std::optional<SvmTrainer> libsvm_;  // made when it is first needed
  bool libsvm_has_kernel_ = false;
  SvmSolution solution_;  // libsvm's
  std::span<const double> coefficient_;
  double bias_ = 0.0;
  bool holds_ = false;
  bool converged_ = true;
  bool by_libsvm_ = false;
  std::size_t step_limit_ = DenseSmo::most_steps;
};

}  // namespace weft::classifier
