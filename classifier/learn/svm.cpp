#include "classifier/learn/svm.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

namespace weft::classifier {
namespace {

svm_parameter parameters(double c, double tolerance) {
  svm_parameter p{};
  p.svm_type = C_SVC;
  p.kernel_type = PRECOMPUTED;
  p.cache_size = 200.0;  // MiB
  p.eps = tolerance;
  p.C = c;
  p.shrinking = 1;
  return p;
}

// Iterations of the last problem on this thread, as libsvm reported them.
thread_local std::size_t iterations = 0;

// libsvm gives up on a problem of `rows` at this number of iterations and returns its current state
// (svm.cpp, Solver::Solve).
std::size_t most_iterations(std::size_t rows) {
  return std::max<std::size_t>(10'000'000, 100 * rows);
}

void capture_iterations(const char* text) {
  constexpr std::string_view words = "#iter = ";
  const std::string_view line(text);
  const std::size_t at = line.find(words);
  if (at != std::string_view::npos)
    std::from_chars(line.data() + at + words.size(), line.data() + line.size(), iterations);
}

}  // namespace

// Negative rows come first and have libsvm label 0, positive rows label 1. libsvm's own positive
// class is then our negative one, as in scikit-learn. Solutions of both agree to the last bits;
// this matters where the loss decides a tie of the grid search.
SvmTrainer::SvmTrainer(std::span<const int> sign) {
  for (const bool positive : {false, true}) {
    for (std::size_t i = 0; i < sign.size(); ++i) {
      if ((sign[i] > 0) != positive) continue;
      order_.push_back(i);
      label_.push_back(positive ? 1.0 : 0.0);
      positives_ += positive ? 1 : 0;
    }
  }
  const std::size_t n = sign.size();
  node_.resize(n * (n + 2));
  for (std::size_t i = 0; i < n; ++i) {
    svm_node* row = node_.data() + i * (n + 2);
    row[0] = {0, static_cast<double>(i + 1)};
    for (std::size_t j = 0; j < n; ++j) row[j + 1].index = static_cast<int>(j + 1);
    row[n + 1].index = -1;
    row_.push_back(row);
  }
}

Status SvmTrainer::set_kernel(const Matrix& kernel) {
  const std::size_t n = order_.size();
  ready_ = false;
  if (kernel.rows() != n || kernel.cols() != n) {
    return fail({.code = Errc::invalid_argument,
                 .where = "SVM",
                 .what = "wrong kernel size",
                 .expected = std::to_string(n),
                 .got = std::to_string(kernel.rows()) + " x " + std::to_string(kernel.cols())});
  }
  if (positives_ == 0 || positives_ == n) {
    return fail(
        {.code = Errc::invalid_argument, .where = "SVM", .what = "class without training rows"});
  }
  const auto& all = kernel.data();
  if (!std::all_of(all.begin(), all.end(), [](double v) { return std::isfinite(v); })) {
    return fail({.code = Errc::invalid_argument,
                 .where = "SVM",
                 .what = "kernel value not finite",
                 .hint = "Check the features for NaN"});
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) row_[i][j + 1].value = kernel(order_[i], order_[j]);
  }
  ready_ = true;
  return {};
}

Result<SvmSolution> SvmTrainer::solve(double c, double tolerance) const {
  if (!ready_) return fail({.code = Errc::wrong_state, .where = "SVM", .what = "no kernel set"});
  if (!(c > 0.0 && std::isfinite(c) && tolerance > 0.0 && std::isfinite(tolerance))) {
    return fail({.code = Errc::range,
                 .where = "SVM",
                 .what = "parameter out of range",
                 .expected = "C > 0 and tolerance > 0, finite",
                 .got = "C " + std::to_string(c) + ", tolerance " + std::to_string(tolerance)});
  }
  silence_libsvm();
  const svm_parameter parameter = parameters(c, tolerance);
  // libsvm takes pointers to non-const but only reads. The copies keep this function const.
  std::vector<double> label = label_;
  std::vector<svm_node*> row = row_;
  const svm_problem problem{static_cast<int>(label.size()), label.data(), row.data()};
  const SvmModel model(svm_train(&problem, &parameter));
  SvmSolution out;
  out.converged = iterations < most_iterations(label.size());
  out.coefficient.assign(label.size(), 0.0);
  out.bias = model->rho[0];  // f = -(sum - rho)
  for (int s = 0; s < model->l; ++s) {
    const auto at = static_cast<std::size_t>(model->sv_indices[s] - 1);
    out.coefficient[order_[at]] = -model->sv_coef[0][s];
  }
  return out;
}

void silence_libsvm() {
  static const bool done = [] {
    svm_set_print_string_function(&capture_iterations);
    return true;
  }();
  static_cast<void>(done);
}

}  // namespace weft::classifier
