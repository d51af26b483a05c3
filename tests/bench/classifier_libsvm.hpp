#pragma once
// The peer of the training: libsvm with a precomputed kernel, and a separate fit for every grid
// point, as in typical user code. Selection, scaling and kernels are shared with ours. Folds,
// scores and the rule of choice are the same, so both must choose the same point.

#include <libsvm/svm.h>

#include <cmath>
#include <tuple>
#include <vector>

#include "classifier/fabric/folds.hpp"
#include "classifier/fabric/reducer.hpp"
#include "classifier/learn/svm_solver.hpp"

namespace weft::bench {

using classifier::Fold;
using classifier::Matrix;
using classifier::TrainOptions;

/// Trial rows of one pair of fabrics.
struct PairRows {
  Matrix rows;
  std::vector<int> sign;
  std::vector<Fold> folds;
};

/// C, gamma and delta of one core, and the number of fits.
struct PlainChoice {
  double c = 0, gamma = 0, delta = 0;
  std::size_t fits = 0;
};

/// A kernel between training rows in libsvm's format; negative rows first.
class PlainSvm {
 public:
  explicit PlainSvm(const std::vector<int>& sign) {
    for (const int side : {-1, 1}) {
      for (std::size_t i = 0; i < sign.size(); ++i)
        if (sign[i] == side) order_.push_back(i), label_.push_back(side > 0 ? 1.0 : 0.0);
    }
    const std::size_t n = sign.size();
    node_.resize(n * (n + 2));
    for (std::size_t i = 0; i < n; ++i) {
      row_.push_back(node_.data() + i * (n + 2));
      row_[i][0] = {0, static_cast<double>(i + 1)};
      for (std::size_t j = 0; j < n; ++j) row_[i][j + 1].index = static_cast<int>(j + 1);
      row_[i][n + 1].index = -1;
    }
    svm_set_print_string_function([](const char*) {});
  }

  void set_kernel(const Matrix& kernel) {
    for (std::size_t i = 0; i < order_.size(); ++i)
      for (std::size_t j = 0; j < order_.size(); ++j)
        row_[i][j + 1].value = kernel(order_[i], order_[j]);
  }

  /// f of every validation row, from its kernel with the training rows.
  void solve(double c, double tolerance, const Matrix& validate, std::vector<double>& f) {
    svm_parameter p{};
    p.kernel_type = PRECOMPUTED;
    p.cache_size = 200.0;
    p.eps = tolerance;
    p.C = c;
    p.shrinking = 1;
    const svm_problem problem{static_cast<int>(label_.size()), label_.data(), row_.data()};
    svm_model* model = svm_train(&problem, &p);
    f.assign(validate.rows(), model->rho[0]);
    for (int s = 0; s < model->l; ++s) {
      const std::size_t at = order_[static_cast<std::size_t>(model->sv_indices[s] - 1)];
      for (std::size_t v = 0; v < f.size(); ++v) f[v] -= model->sv_coef[0][s] * validate(v, at);
    }
    svm_free_and_destroy_model(&model);
  }

 private:
  std::vector<std::size_t> order_;
  std::vector<double> label_;
  std::vector<svm_node> node_;
  std::vector<svm_node*> row_;
};

/// Sums of one grid point over the folds.
struct PlainScore {
  std::size_t errors = 0;
  double loss = 0.0;
};

inline std::vector<int> signs_of(const PairRows& pair, const std::vector<std::size_t>& rows) {
  std::vector<int> out;
  for (const std::size_t r : rows) out.push_back(pair.sign[r]);
  return out;
}

inline void add_score(const std::vector<double>& f, const std::vector<int>& sign,
                      PlainScore& score) {
  for (std::size_t v = 0; v < f.size(); ++v) {
    score.errors += (f[v] > 0.0) == (sign[v] > 0) ? 0 : 1;
    score.loss += std::max(0.0, 1.0 - sign[v] * f[v]);
  }
}

/// Adds all fits of one fold to `scores` [deltas x gammas x Cs]. Returns their number.
inline std::size_t plain_fold(const PairRows& pair, const Fold& fold, const TrainOptions& options,
                              std::vector<PlainScore>& scores) {
  const Matrix train = pair.rows.take(fold.train), validate = pair.rows.take(fold.validate);
  const std::vector<int> train_sign = signs_of(pair, fold.train);
  const std::vector<int> sign = signs_of(pair, fold.validate);
  const auto reducer = classifier::Reducer::fit(train, train_sign, options);
  const Matrix a = reducer.project(train), b = reducer.project(validate);
  PlainSvm svm(train_sign);
  std::vector<double> f;
  std::size_t at = 0;
  for (const std::size_t size : reducer.sizes()) {
    Matrix aa(a.rows(), a.rows()), ba(b.rows(), a.rows());
    classifier::add_squared_distances(a, a, 0, size, aa);
    classifier::add_squared_distances(b, a, 0, size, ba);
    for (const double gamma : options.grid.gamma) {
      const Matrix kernel = classifier::rbf(ba, gamma);
      svm.set_kernel(classifier::rbf(aa, gamma));
      for (const double c : options.grid.c) {
        svm.solve(c, options.tolerance, kernel, f);
        add_score(f, sign, scores[at++]);
      }
    }
  }
  return at;
}

/// The point with fewest errors, then smallest loss (to 1e-9), C, gamma, delta.
inline PlainChoice plain_search(const PairRows& pair, const TrainOptions& options) {
  const auto& [cs, gammas, deltas, shares] = options.grid;
  std::vector<PlainScore> scores(cs.size() * gammas.size() * deltas.size());
  PlainChoice out;
  for (const Fold& fold : pair.folds) out.fits += plain_fold(pair, fold, options, scores);
  auto best = std::tuple(std::size_t(-1), 0.0, 0.0, 0.0, 0.0);
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const auto key =
        std::tuple(scores[i].errors, std::nearbyint(scores[i].loss * 1e9), cs[i % cs.size()],
                   gammas[i / cs.size() % gammas.size()], deltas[i / cs.size() / gammas.size()]);
    best = std::min(best, key);
  }
  out.c = std::get<2>(best), out.gamma = std::get<3>(best), out.delta = std::get<4>(best);
  return out;
}

}  // namespace weft::bench
