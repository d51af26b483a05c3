#include "classifier/imprint/linear_rule.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "protocols/base/names.hpp"

namespace weft::classifier::imprint {

Scaler scaler_for(FeatureScaling scaling, const Matrix& rows) {
  if (scaling == FeatureScaling::zscore) return fit_scaler(rows);
  return {std::vector<double>(rows.cols(), 0.0), std::vector<double>(rows.cols(), 1.0)};
}

Status check_training(const Matrix& rows, std::span<const std::size_t> of_row,
                      std::size_t classes) {
  if (rows.rows() == 0 || rows.rows() != of_row.size() || classes < 2)
    return fail({.code = Errc::invalid_argument,
                 .where = "training",
                 .what = "a rule needs rows of at least two classes",
                 .expected = "a class for every row",
                 .got = std::to_string(rows.rows()) + " rows, " + std::to_string(of_row.size()) +
                        " of them with a class, " + std::to_string(classes) + " classes"});
  if (!std::all_of(of_row.begin(), of_row.end(), [&](std::size_t c) { return c < classes; }))
    return fail({.code = Errc::range,
                 .where = "training",
                 .what = "a row is of a class that does not exist"});
  for (const double value : rows.data())
    if (!(std::abs(value) <= 1e100))
      return fail({.code = Errc::range,
                   .where = "training",
                   .what = "a feature has no usable value",
                   .expected = "a finite value up to 1e100",
                   .got = format_number(value)});
  return {};
}

Result<std::size_t> LinearRule::classify(std::span<const double> features) const {
  const std::size_t inputs = weight_.cols() - 1;
  if (features.size() != inputs)
    return fail({.code = Errc::invalid_argument,
                 .where = "linear rule",
                 .what = "wrong number of features",
                 .expected = std::to_string(inputs),
                 .got = std::to_string(features.size())});
  std::size_t best = 0;
  double largest = 0.0;
  for (std::size_t c = 0; c < weight_.rows(); ++c) {
    double product = 0.0;
    for (std::size_t k = 0; k < inputs; ++k)
      product += weight_(c, k) * scaler_.apply(k, features[k]);
    product += weight_(c, inputs);
    if (!std::isfinite(product))
      return fail({.code = Errc::range,
                   .where = "linear rule",
                   .what = "a product is not finite",
                   .hint = "The imprint is absurdly far from every training imprint"});
    if (c > 0 && product <= largest) continue;
    best = c;
    largest = product;
  }
  return best;
}

Matrix with_ones(const Matrix& rows) {
  Matrix out(rows.rows(), rows.cols() + 1, 1.0);
  for (std::size_t r = 0; r < rows.rows(); ++r)
    std::copy(rows.row(r).begin(), rows.row(r).end(), out.row(r).begin());
  return out;
}

namespace {

std::size_t answer(const Matrix& weight, std::span<const double> row) {
  std::size_t best = 0;
  double largest = 0.0;
  for (std::size_t c = 0; c < weight.rows(); ++c) {
    double product = 0.0;
    const auto w = weight.row(c);
    for (std::size_t k = 0; k < row.size(); ++k) product += w[k] * row[k];
    if (c > 0 && product <= largest) continue;
    best = c;
    largest = product;
  }
  return best;
}

void add(std::span<double> weight, double factor, std::span<const double> row) {
  for (std::size_t k = 0; k < row.size(); ++k) weight[k] += factor * row[k];
}

std::size_t one_round(const Matrix& rows, std::span<const std::size_t> of_row, double c,
                      Matrix& weight) {
  std::size_t mistakes = 0;
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    const std::size_t predicted_as = answer(weight, rows.row(r));
    if (predicted_as == of_row[r]) continue;
    add(weight.row(of_row[r]), c, rows.row(r));
    add(weight.row(predicted_as), -c, rows.row(r));
    ++mistakes;
  }
  return mistakes;
}

}  // namespace

Result<KeslerOutcome> train_kesler(const Matrix& rows, std::span<const std::size_t> of_row,
                                   std::size_t classes, const KeslerOptions& options) {
  if (auto ok = check_training(rows, of_row, classes); !ok) return pass(ok.error(), "perceptron");
  if (!(options.c > 0.0 && options.c <= 1e6) || options.most_rounds == 0)
    return fail(
        {.code = Errc::range,
         .where = "perceptron",
         .what = "a perceptron cannot learn with this",
         .expected = "0 < c <= 1e6, at least one round",
         .got = "c " + std::to_string(options.c) + ", " + std::to_string(options.most_rounds)});
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
                 .what = "the squares cannot be minimised"});
  Matrix weight(classes, inputs.cols());
  for (std::size_t c = 0; c < classes; ++c)
    for (std::size_t k = 0; k < inputs.cols(); ++k) weight(c, k) = solution(index(k), index(c));
  return LinearRule(std::move(scaler), std::move(weight));
}

}  // namespace weft::classifier::imprint
