#include "classifier/fabric/core.hpp"

#include <cmath>

#include "classifier/base/student_t.hpp"
#include "classifier/learn/distance.hpp"
#include "classifier/learn/svm_solver.hpp"

namespace weft::classifier {
namespace {

double threshold_of(const TrainOptions& options, std::size_t member) {
  switch (options.reduction) {
    case Reduction::pvalue:
      return options.grid.delta[member];
    case Reduction::pca:
      return options.grid.explained[member];
    case Reduction::all:
      break;
  }
  return 0.0;
}

std::vector<SelectedFeature> describe_selection(const Reducer& reducer) {
  std::vector<SelectedFeature> out;
  for (std::size_t i = 0; i < reducer.t().size(); ++i) {
    const double t = reducer.t()[i];
    const double log_p = log_two_sided_p(t, reducer.df()[i]);
    out.push_back({reducer.columns()[i], t, std::exp(log_p), log_p});
  }
  return out;
}

CoreInfo describe(const Reducer& reducer, const GridResult& grid, std::size_t rows,
                  const TrainOptions& options) {
  CoreInfo info;
  info.selected = describe_selection(reducer);
  info.inputs = reducer.directions();
  info.threshold = threshold_of(options, grid.member);
  info.c = options.grid.c[grid.c];
  info.gamma = options.grid.gamma[grid.gamma];
  info.cv_errors = grid.best.errors;
  info.cv_loss = grid.best.loss;
  info.train_rows = rows;
  info.fits = grid.fits;
  return info;
}

struct Trained {
  std::vector<std::size_t> support;  // rows
  std::vector<double> coefficient;
  double bias = 0.0;
};

Result<Trained> fit_final(const Matrix& projected, std::span<const int> sign, const CoreInfo& info,
                          const TrainOptions& options) {
  Matrix kernel(projected.rows(), projected.rows());
  add_squared_distances(projected, projected, 0, projected.cols(), kernel);
  rbf(Matrix(kernel), info.gamma, kernel);
  SvmSolver solver(sign, options.search != Search::libsvm);
  if (auto ok = solver.set_kernel(kernel); !ok) return pass(ok.error());
  if (auto ok = solver.solve(info.c, options.tolerance); !ok) return pass(ok.error());
  if (!solver.converged()) note_unconverged(options);
  Trained out;
  out.bias = solver.bias();
  for (std::size_t i = 0; i < sign.size(); ++i) {
    if (solver.coefficient()[i] == 0.0) continue;
    out.support.push_back(i);
    out.coefficient.push_back(solver.coefficient()[i]);
  }
  return out;
}

}  // namespace

FabricCore::FabricCore(CoreInfo info, Reducer reducer, Matrix support,
                       std::vector<double> coefficient, double bias)
    : info_(std::move(info)),
      reducer_(std::move(reducer)),
      support_(std::move(support)),
      coefficient_(std::move(coefficient)),
      bias_(bias),
      packed_(reducer_, support_, coefficient_, info_.gamma, bias_) {}

Result<FabricCore> train_core(const Matrix& rows, std::span<const int> sign,
                              std::span<const Fold> folds, const TrainOptions& options,
                              const RareT& rare, GridSearch& search) {
  const Reducer full = Reducer::fit(rows, sign, options, rare);
  const auto grid = search.run(rows, sign, full, folds, options, rare);
  if (!grid) return pass(grid.error());
  Reducer reducer = full.truncated(full.sizes()[grid->member]);
  CoreInfo info = describe(reducer, *grid, rows.rows(), options);
  info.folds = folds.size();
  const Matrix projected = reducer.project(rows);
  auto svm = fit_final(projected, sign, info, options);
  if (!svm) return pass(svm.error());
  return FabricCore(std::move(info), std::move(reducer), projected.take(svm->support),
                    std::move(svm->coefficient), svm->bias);
}

}  // namespace weft::classifier
