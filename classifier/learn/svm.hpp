#pragma once
// Two-class soft-margin support vector machine on a kernel matrix: a wrapper around libsvm, the
// reference solver.

#include <libsvm/svm.h>

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

// Shared by all users of libsvm. Only for .cpp files: it includes libsvm's header.

/// libsvm reports progress through one process-wide function. This silences it once, before the
/// first training. Only the number of iterations is kept, for SvmSolution::converged.
void silence_libsvm();

struct FreeSvmModel {
  void operator()(svm_model* model) const { svm_free_and_destroy_model(&model); }
};
using SvmModel = std::unique_ptr<svm_model, FreeSvmModel>;

/// f(x) = sum_i coefficient[i] K(x, row i) + bias; f > 0 is the positive class.
struct SvmSolution {
  std::vector<double> coefficient;  ///< alpha_i y_i per training row; 0 if it is no support vector
  double bias = 0.0;
  bool converged = true;  ///< false: libsvm gave up at its limit of iterations
};

/// Trains on one set of rows with several kernels and several C. One object per thread.
class SvmTrainer {
 public:
  /// `sign`: +1 or -1 per training row; both must occur.
  explicit SvmTrainer(std::span<const int> sign);
  SvmTrainer(SvmTrainer&&) noexcept = default;  // row_ points into node_: not copied
  SvmTrainer& operator=(SvmTrainer&&) noexcept = default;

  /// [n x n] kernel values between the training rows. Refuses a wrong size, one class only, NaN and
  /// infinity (libsvm itself trains on NaN without an error).
  Status set_kernel(const Matrix& kernel);

  /// Solves for 0 < c, to libsvm's stopping tolerance > 0. Deterministic.
  Result<SvmSolution> solve(double c, double tolerance) const;

 private:
  std::vector<std::size_t> order_;  // libsvm's row -> our row: negative rows first
  std::vector<double> label_;       // libsvm's labels in that order
  std::vector<svm_node> node_;      // [n x (n + 2)]
  std::vector<svm_node*> row_;
  std::size_t positives_ = 0;
  bool ready_ = false;
};

}  // namespace weft::classifier
