#include "classifier/imprint/linear_rule.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "protocols/base/number_text.hpp"

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

}  // namespace weft::classifier::imprint
