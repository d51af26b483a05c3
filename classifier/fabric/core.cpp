#include "classifier/fabric/core.hpp"

#include <cmath>

#include "classifier/learn/distance.hpp"
#include "classifier/learn/svm.hpp"
#include "classifier/selection/student_t.hpp"
#include "classifier/selection/t_test.hpp"

namespace weft::classifier {
namespace {

double threshold_of(const TrainOptions& options, std::size_t member) {
  switch (options.reduction) {
    case Reduction::pvalue:
      return options.grid.delta[member];
    case Reduction::pca:
      return options.grid.explained[member];
    case Reduction::all:
    case Reduction::best:
      break;
  }
  return 0.0;
}

std::vector<SelectedFeature> describe_selection(const Matrix& rows, std::span<const int> sign,
                                                const Reducer& reducer) {
  const std::vector<double> t = t_statistics(rows, sign);
  const double df = static_cast<double>(rows.rows()) - 2.0;
  std::vector<SelectedFeature> out;
  for (const std::size_t k : reducer.columns()) {
    out.push_back({k, t[k], two_sided_p(t[k], df), log_two_sided_p(t[k], df)});
  }
  return out;
}

CoreInfo describe(const Matrix& rows, std::span<const int> sign, const Reducer& reducer,
                  const GridResult& grid, const TrainOptions& options) {
  CoreInfo info;
  if (options.reduction == Reduction::pvalue)
    info.selected = describe_selection(rows, sign, reducer);
  info.inputs = reducer.directions();
  info.threshold = threshold_of(options, grid.member);
  info.c = options.grid.c[grid.c];
  info.gamma = options.grid.gamma[grid.gamma];
  info.cv_errors = grid.best.errors;
  info.cv_loss = grid.best.loss;
  info.train_rows = rows.rows();
  info.fits = grid.fits;
  return info;
}

Result<SvmSolution> fit_final(const Matrix& projected, std::span<const int> sign,
                              const CoreInfo& info, double tolerance) {
  Matrix squared(projected.rows(), projected.rows());
  add_squared_distances(projected, projected, 0, projected.cols(), squared);
  SvmTrainer trainer(sign);
  if (auto ok = trainer.set_kernel(rbf(squared, info.gamma)); !ok) return pass(ok.error());
  return trainer.solve(info.c, tolerance);
}

}  // namespace

FabricCore::FabricCore(CoreInfo info, Reducer reducer, Matrix support,
                       std::vector<double> coefficient, double bias)
    : info_(std::move(info)),
      reducer_(std::move(reducer)),
      support_(std::move(support)),
      coefficient_(std::move(coefficient)),
      bias_(bias) {}

double FabricCore::decide(std::span<const double> features) const {
  std::vector<double> x(reducer_.directions());
  reducer_.project(features, x);
  double f = 0.0;
  for (std::size_t s = 0; s < support_.rows(); ++s) {
    const auto sv = support_.row(s);
    double squared = 0.0;
    for (std::size_t k = 0; k < x.size(); ++k) squared += (x[k] - sv[k]) * (x[k] - sv[k]);
    f += coefficient_[s] * std::exp(-info_.gamma * squared);
  }
  return f + bias_;
}

Result<FabricCore> train_core(const Matrix& rows, std::span<const int> sign,
                              std::span<const Fold> folds, const TrainOptions& options) {
  if (options.reduction == Reduction::best) {
    return fail(Errc::invalid_argument, "a core needs one kind of reduction", "train_core",
                "pvalue, pca or all", "best");
  }
  const Reducer full = Reducer::fit(rows, sign, options);
  const auto grid = search_grid(rows, sign, full, folds, options);
  if (!grid) return pass(grid.error());
  Reducer reducer = full.truncated(full.sizes()[grid->member]);
  CoreInfo info = describe(rows, sign, reducer, *grid, options);
  info.folds = folds.size();
  const Matrix projected = reducer.project(rows);
  const auto svm = fit_final(projected, sign, info, options.tolerance);
  if (!svm) return pass(svm.error());
  std::vector<std::size_t> support;
  std::vector<double> coefficient;
  for (std::size_t i = 0; i < sign.size(); ++i) {
    if (svm->coefficient[i] == 0.0) continue;
    support.push_back(i);
    coefficient.push_back(svm->coefficient[i]);
  }
  return FabricCore(std::move(info), std::move(reducer), projected.take(support),
                    std::move(coefficient), svm->bias);
}

}  // namespace weft::classifier
