#include "classifier/learners/linear_rule.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "classifier/fabric/model_text.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learners/learners.hpp"
#include "protocols/base/names.hpp"

namespace weft::classifier {

Scaler scaler_for(FeatureScaling scaling, const Matrix& rows) {
  if (scaling == FeatureScaling::zscore) return fit_scaler(rows);
  return {std::vector<double>(rows.cols(), 0.0), std::vector<double>(rows.cols(), 1.0)};
}

Status check_training(const Matrix& rows, std::span<const std::size_t> of_row,
                      std::size_t classes) {
  if (rows.rows() == 0 || rows.rows() != of_row.size() || classes < 2)
    return fail({.code = Errc::invalid_argument,
                 .where = "training",
                 .what = "too few rows or classes",
                 .expected = "a class for every row, at least 2 classes",
                 .got = std::to_string(rows.rows()) + " rows, " + std::to_string(of_row.size()) +
                        " class numbers, " + std::to_string(classes) + " classes"});
  if (!std::all_of(of_row.begin(), of_row.end(), [&](std::size_t c) { return c < classes; }))
    return fail(
        {.code = Errc::range, .where = "training", .what = "class number of a row out of range"});
  for (const double value : rows.data())
    if (!(std::abs(value) <= 1e100))
      return fail({.code = Errc::range,
                   .where = "training",
                   .what = "feature value out of range",
                   .expected = "finite, magnitude up to 1e100",
                   .got = format_number(value)});
  return {};
}

namespace {

// Row with the largest inner product of its weights and `input(k)` for every column k. The last
// column is the bias and is added last. The lowest row wins a tie. Empty if a product is not
// finite. The products are written to `products` if it has room.
template <class Input>
std::optional<std::size_t> answer(const Matrix& weight, const Input& input,
                                  std::span<double> products = {}) {
  const std::size_t inputs = weight.cols() - 1;
  std::size_t best = 0;
  double largest = 0.0;
  for (std::size_t c = 0; c < weight.rows(); ++c) {
    double product = 0.0;
    const auto w = weight.row(c);
    for (std::size_t k = 0; k < inputs; ++k) product += w[k] * input(k);
    product += w[inputs];
    if (!std::isfinite(product)) return std::nullopt;
    if (!products.empty()) products[c] = product;
    if (c > 0 && product <= largest) continue;
    best = c;
    largest = product;
  }
  return best;
}

}  // namespace

Result<ClassScores> LinearRule::predict(std::span<const double> features) const {
  if (auto ok = check_length(features, weight_.cols() - 1, "linear rule"); !ok)
    return pass(ok.error());
  const auto scaled_input = [&](std::size_t k) { return scaler_.apply(k, features[k]); };
  std::vector<double> product(weight_.rows());
  const auto best = answer(weight_, scaled_input, product);
  if (!best)
    return fail({.code = Errc::range,
                 .where = "linear rule",
                 .what = "product not finite",
                 .hint = "Check the row: its values are far outside the training range"});
  ClassScores out{class_of_row_[*best], std::vector<double>(weight_.rows())};
  for (std::size_t c = 0; c < product.size(); ++c) out.score[class_of_row_[c]] = product[c];
  return out;
}

void LinearRule::write(LineWriter& out) const {
  write_scaler(out, scaler_);
  out.counts("class_of_row", class_of_row_);
  write_rows(out, "weight", weight_);
}

LinearRule LinearRule::read(LineReader& in, std::size_t features, std::size_t classes) {
  Scaler scaler = read_scaler(in, features);
  std::vector<std::size_t> class_of_row = in.counts("class_of_row", classes);
  in.within(class_of_row, classes, "class");
  if (std::set(class_of_row.begin(), class_of_row.end()).size() != class_of_row.size())
    in.refuse("class with two rows of weights");
  Matrix weight = read_rows(in, "weight", classes, features + 1);
  return {std::move(scaler), std::move(weight), std::move(class_of_row), {}};
}

Matrix with_ones(const Matrix& rows) {
  Matrix out(rows.rows(), rows.cols() + 1, 1.0);
  for (std::size_t r = 0; r < rows.rows(); ++r)
    std::copy(rows.row(r).begin(), rows.row(r).end(), out.row(r).begin());
  return out;
}

namespace {

void add(std::span<double> weight, double factor, std::span<const double> row) {
  for (std::size_t k = 0; k < row.size(); ++k) weight[k] += factor * row[k];
}

// Products are finite: rows are up to 1e100 (check_training()), `c` up to 1e6 (train_kesler()), and
// most_rounds is below 2^64.
std::size_t one_round(const Matrix& rows, std::span<const std::size_t> of_row, double c,
                      Matrix& weight) {
  std::size_t mistakes = 0;
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    const auto row = rows.row(r);
    const std::size_t predicted_as = answer(weight, [&](std::size_t k) { return row[k]; }).value();
    if (predicted_as == of_row[r]) continue;
    add(weight.row(of_row[r]), c, row);
    add(weight.row(predicted_as), -c, row);
    ++mistakes;
  }
  return mistakes;
}

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double no_distance = 1e-7;
constexpr double least_product = 1e-10;  // for unit vectors; far above rounding
constexpr double least_weight = 1e-12;

// One vector of a row and a wrong class, of unit length: +row in the block of weights of its own
// class, -row in that of the wrong class, divided by sqrt 2.
struct Corner {
  Index row;
  Index own, wrong;
};

class Hull {
 public:
  Hull(const Matrix& rows, std::span<const std::size_t> of_row, std::size_t classes)
      : rows_(static_cast<Index>(rows.rows()), static_cast<Index>(rows.cols())) {
    for (Index r = 0; r < rows_.rows(); ++r) {
      const auto from = rows.row(static_cast<std::size_t>(r));
      rows_.row(r) = Eigen::Map<const Eigen::RowVectorXd>(from.data(), rows_.cols()).normalized();
      const auto own = static_cast<Index>(of_row[static_cast<std::size_t>(r)]);
      for (Index wrong = 0; wrong < static_cast<Index>(classes); ++wrong)
        if (wrong != own) corners_.push_back({r, own, wrong});
    }
    products_ = rows_ * rows_.transpose();
    weight_ = MatrixXd::Zero(static_cast<Index>(classes), rows_.cols());
  }

  [[nodiscard]] double product(const Corner& a, const Corner& b) const {
    const double blocks = (a.own == b.own ? 1.0 : 0.0) - (a.own == b.wrong ? 1.0 : 0.0) -
                          (a.wrong == b.own ? 1.0 : 0.0) + (a.wrong == b.wrong ? 1.0 : 0.0);
    return 0.5 * blocks * products_(a.row, b.row);
  }

  /// The corner with the least product with the point, and that product.
  std::pair<std::size_t, double> least() {
    const MatrixXd scores = rows_ * weight_.transpose();
    std::pair<std::size_t, double> out{0, std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      const Corner& c = corners_[i];
      const double value = (scores(c.row, c.own) - scores(c.row, c.wrong)) / std::sqrt(2.0);
      if (value < out.second) out = {i, value};
    }
    return out;
  }

  /// Sets the point to a combination of corners.
  void place(const std::vector<std::size_t>& corral, const VectorXd& share) {
    weight_.setZero();
    for (std::size_t i = 0; i < corral.size(); ++i) {
      const Corner& c = corners_[corral[i]];
      const Eigen::RowVectorXd part =
          share(static_cast<Index>(i)) / std::sqrt(2.0) * rows_.row(c.row);
      weight_.row(c.own) += part;
      weight_.row(c.wrong) -= part;
    }
  }

  [[nodiscard]] double squared_length() const { return weight_.squaredNorm(); }
  [[nodiscard]] const std::vector<Corner>& corners() const { return corners_; }

 private:
  MatrixXd rows_, products_, weight_;
  std::vector<Corner> corners_;
};

// Shares (sum 1) of the point nearest to the origin in the plane through the corral.
VectorXd nearest_in_plane(const Hull& hull, const std::vector<std::size_t>& corral) {
  const auto n = static_cast<Index>(corral.size());
  MatrixXd system(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j <= i; ++j)
      system(i, j) = system(j, i) =
          1.0 + hull.product(hull.corners()[corral[static_cast<std::size_t>(i)]],
                             hull.corners()[corral[static_cast<std::size_t>(j)]]);
  const VectorXd solution = system.ldlt().solve(VectorXd::Ones(n));
  return solution / solution.sum();
}

// Wolfe's minor cycle: moves towards the plane's nearest point until a share would become negative,
// and drops that corner.
void shrink(const Hull& hull, std::vector<std::size_t>& corral, VectorXd& share) {
  for (;;) {
    const VectorXd goal = nearest_in_plane(hull, corral);
    if (goal.minCoeff() > least_weight || corral.size() == 1) {
      share = goal;
      return;
    }
    double step = 1.0;
    for (Index i = 0; i < goal.size(); ++i)
      if (goal(i) <= least_weight && share(i) > goal(i))
        step = std::min(step, share(i) / (share(i) - goal(i)));
    share = (1.0 - step) * share + step * goal;
    std::vector<std::size_t> retained;
    std::vector<double> retained_share;
    for (Index i = 0; i < share.size(); ++i)
      if (share(i) > least_weight) {
        retained.push_back(corral[static_cast<std::size_t>(i)]);
        retained_share.push_back(share(i));
      }
    if (retained.size() == corral.size() || retained.empty())
      return;  // rounding: no corner to drop
    corral = std::move(retained);
    share = Eigen::Map<const VectorXd>(retained_share.data(),
                                       static_cast<Index>(retained_share.size()));
    share /= share.sum();
  }
}

SeparabilityOutcome walk(Hull& hull, std::size_t most_steps) {
  std::vector<std::size_t> corral{0};
  VectorXd share = VectorXd::Ones(1);
  SeparabilityOutcome out;
  for (out.steps = 1; out.steps <= most_steps; ++out.steps) {
    hull.place(corral, share);
    const double length = std::sqrt(hull.squared_length());
    if (length <= no_distance) {
      out.verdict = Separability::not_separable;
      return out;
    }
    const auto [corner, product] = hull.least();
    if (product > least_product * length) {
      out.verdict = Separability::separable;
      out.margin = product / length;
      return out;
    }
    if (std::find(corral.begin(), corral.end(), corner) != corral.end()) return out;  // rounding
    corral.push_back(corner);
    share.conservativeResize(share.size() + 1);
    share(share.size() - 1) = 0.0;
    shrink(hull, corral, share);
  }
  return out;
}

}  // namespace

Result<KeslerOutcome> train_kesler(const Matrix& rows, std::span<const std::size_t> of_row,
                                   std::size_t classes, const KeslerOptions& options) {
  if (auto ok = check_training(rows, of_row, classes); !ok) return pass(ok.error(), "perceptron");
  if (!(options.c > 0.0 && options.c <= 1e6) || options.most_rounds == 0)
    return fail({.code = Errc::range,
                 .where = "perceptron",
                 .what = "perceptron parameter out of range",
                 .expected = "c above 0 and at most 1e6, at least 1 round",
                 .got = "c " + std::to_string(options.c) + ", rounds " +
                        std::to_string(options.most_rounds)});
  Scaler scaler = scaler_for(options.scaling, rows);
  const Matrix inputs = with_ones(scaled(scaler, rows));
  Matrix weight(classes, inputs.cols());
  std::size_t rounds = 0, mistakes = 1;
  while (mistakes > 0 && rounds < options.most_rounds) {
    mistakes = one_round(inputs, of_row, options.c, weight);
    ++rounds;
  }
  return KeslerOutcome{LinearRule(std::move(scaler), std::move(weight)), mistakes == 0, rounds,
                       mistakes};
}

Result<LinearRule> train_least_squares(const Matrix& rows, std::span<const std::size_t> of_row,
                                       std::size_t classes, FeatureScaling scaling) {
  if (auto ok = check_training(rows, of_row, classes); !ok)
    return pass(ok.error(), "minimum squared error");
  Scaler scaler = scaler_for(scaling, rows);
  const Matrix inputs = with_ones(scaled(scaler, rows));
  const auto index = [](std::size_t i) { return static_cast<Eigen::Index>(i); };
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Map<const RowMajor> x(inputs.data().data(), index(inputs.rows()),
                                     index(inputs.cols()));
  Eigen::MatrixXd target = Eigen::MatrixXd::Zero(index(rows.rows()), index(classes));
  for (std::size_t r = 0; r < of_row.size(); ++r) target(index(r), index(of_row[r])) = 1.0;
  const Eigen::MatrixXd solution = x.completeOrthogonalDecomposition().solve(target);
  if (!solution.allFinite())
    return fail({.code = Errc::range,
                 .where = "minimum squared error",
                 .what = "squared error not minimised"});
  Matrix weight(classes, inputs.cols());
  for (std::size_t c = 0; c < classes; ++c)
    for (std::size_t k = 0; k < inputs.cols(); ++k) weight(c, k) = solution(index(k), index(c));
  return LinearRule(std::move(scaler), std::move(weight));
}

std::string_view to_string(Separability verdict) {
  constexpr NameTable<Separability, 3> names = {{
      {Separability::separable, "separable"},
      {Separability::not_separable, "not separable"},
      {Separability::undecided, "undecided"},
  }};
  return name_in(names, verdict);
}

Result<SeparabilityOutcome> separability(const Matrix& rows, std::span<const std::size_t> of_row,
                                         std::size_t classes, std::size_t most_steps) {
  if (auto ok = check_training(rows, of_row, classes); !ok) return pass(ok.error(), "separability");
  Hull hull(with_ones(scaled(fit_scaler(rows), rows)), of_row, classes);
  return walk(hull, most_steps);
}

namespace {

/// Classes in the order of their first rows: the perceptron takes the first of equal products.
struct Appearance {
  std::vector<std::size_t> of_row;    ///< position of the row's class in that order
  std::vector<std::size_t> class_at;  ///< class by its position
};

Appearance by_appearance(std::span<const std::size_t> of_row) {
  Appearance out;
  std::map<std::size_t, std::size_t> place;
  for (const std::size_t c : of_row) {
    const auto [at, is_new] = place.emplace(c, place.size());
    if (is_new) out.class_at.push_back(c);
    out.of_row.push_back(at->second);
  }
  return out;
}

PredictorPtr in_order(const LinearRule& rule, Appearance order, FitReport report = {}) {
  return std::make_unique<LinearRule>(rule.scaler(), rule.weight(), std::move(order.class_at),
                                      report);
}

Result<PredictorPtr> fit_kesler(const TrainingSet& training, FeatureScaling scaling) {
  Appearance order = by_appearance(training.of_row());
  KeslerOptions options;
  options.scaling = scaling;
  auto out = train_kesler(training.rows(), order.of_row, training.classes(), options);
  if (!out) return pass(out.error());
  return in_order(out->rule, std::move(order), {out->converged, out->rounds});
}

}  // namespace

Result<PredictorPtr> fit_perceptron(const TrainingSet& training, const TrainOptions& /*options*/) {
  return fit_kesler(training, FeatureScaling::none);
}

Result<PredictorPtr> fit_scaled_perceptron(const TrainingSet& training,
                                           const TrainOptions& /*options*/) {
  return fit_kesler(training, FeatureScaling::zscore);
}

Result<PredictorPtr> fit_least_squares(const TrainingSet& training,
                                       const TrainOptions& /*options*/) {
  Appearance order = by_appearance(training.of_row());
  auto out = train_least_squares(training.rows(), order.of_row, training.classes(),
                                 FeatureScaling::zscore);
  if (!out) return pass(out.error());
  return in_order(*out, std::move(order));
}

Result<PredictorPtr> fit_ridge(const TrainingSet& training, const TrainOptions& /*options*/) {
  Appearance order = by_appearance(training.of_row());
  auto out = train_ridge(training.rows(), order.of_row, training.classes());
  if (!out) return pass(out.error());
  return in_order(out->rule, std::move(order));
}

}  // namespace weft::classifier
