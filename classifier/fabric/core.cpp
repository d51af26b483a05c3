#include "classifier/fabric/core.hpp"

#include <array>
#include <cmath>

#include "classifier/base/student_t.hpp"
#include "classifier/learn/block.hpp"
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
  std::vector<std::size_t> support;  // row numbers
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

namespace {

std::size_t whole_blocks(std::size_t count) {
  return (count + lanes - 1) / lanes * lanes;
}

// Appends the transposed matrix, [cols x width]; the padding is zero.
void append_transposed(const Matrix& from, std::size_t width, std::vector<double>& to) {
  for (std::size_t c = 0; c < from.cols(); ++c)
    for (std::size_t r = 0; r < width; ++r) to.push_back(r < from.rows() ? from(r, c) : 0.0);
}

}  // namespace

// Pointers to the parts of PackedCore::data_.
struct PackedView {
  const std::uint32_t* column;
  std::size_t columns, directions, vectors, axes_width, support_width;
  const double *mean, *deviation, *axes, *support, *coefficient;
  double gamma, bias;

  explicit PackedView(const PackedCore& core)
      : column(core.columns_.data()),
        columns(core.columns_.size()),
        directions(core.directions_),
        vectors(core.vectors_),
        axes_width(core.axes_width_),
        support_width(core.support_width_),
        mean(core.data_.data()),
        deviation(mean + columns),
        axes(deviation + columns),
        support(axes + columns * axes_width),
        coefficient(support + directions * support_width),
        gamma(core.gamma_),
        bias(core.bias_) {}

  [[nodiscard]] std::size_t scratch() const { return columns + axes_width + support_width; }
};

namespace {

// Sums run over columns and directions in their order, one lane per component or support vector.
// The result has the same bits as the plain loops.
WEFT_CLONES("arch=x86-64-v4", "avx2")
double decide_packed(const PackedView& v, const double* features, double* scratch) {
  double* const scaled = scratch;
  for (std::size_t k = 0; k < v.columns; ++k)
    scaled[k] = (features[v.column[k]] - v.mean[k]) / v.deviation[k];
  const double* x = scaled;
  if (v.axes_width > 0) {
    double* const components = scratch + v.columns;
    for (std::size_t c = 0; c < v.axes_width; c += lanes) {
      Block sum = all(0.0);
      for (std::size_t k = 0; k < v.columns; ++k)
        sum += all(scaled[k]) * load(v.axes + k * v.axes_width + c);
      store(components + c, sum);
    }
    x = components;
  }
  double* const kernel = scratch + v.columns + v.axes_width;
  for (std::size_t s = 0; s < v.support_width; s += lanes) {
    Block squared = all(0.0);
    for (std::size_t k = 0; k < v.directions; ++k) {
      const Block d = all(x[k]) - load(v.support + k * v.support_width + s);
      squared += d * d;
    }
    store(kernel + s, exp_block(squared * all(-v.gamma)));
  }
  double f = 0.0;
  for (std::size_t s = 0; s < v.vectors; ++s) f += v.coefficient[s] * kernel[s];
  return f + v.bias;
}

}  // namespace

PackedCore::PackedCore(const Reducer& reducer, const Matrix& support,
                       std::span<const double> coefficient, double gamma, double bias)
    : directions_(reducer.directions()),
      vectors_(support.rows()),
      axes_width_(whole_blocks(reducer.axes().rows())),
      support_width_(whole_blocks(support.rows())),
      gamma_(gamma),
      bias_(bias) {
  for (const std::size_t c : reducer.columns()) columns_.push_back(static_cast<std::uint32_t>(c));
  const Scaler& scaler = reducer.scaler();
  data_.reserve(columns_.size() * (2 + axes_width_) + directions_ * support_width_ + vectors_);
  data_.insert(data_.end(), scaler.mean.begin(), scaler.mean.end());
  data_.insert(data_.end(), scaler.deviation.begin(), scaler.deviation.end());
  append_transposed(reducer.axes(), axes_width_, data_);
  append_transposed(support, support_width_, data_);
  data_.insert(data_.end(), coefficient.begin(), coefficient.end());
}

double PackedCore::decide(std::span<const double> features) const {
  const PackedView view(*this);
  if (view.scratch() > most_on_stack) {
    std::vector<double> scratch(view.scratch());
    return decide_packed(view, features.data(), scratch.data());
  }
  std::array<double, most_on_stack> scratch;  // written before it is read
  return decide_packed(view, features.data(), scratch.data());
}

}  // namespace weft::classifier
