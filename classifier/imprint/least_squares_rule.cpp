#include "classifier/imprint/least_squares_rule.hpp"

#include <Eigen/Dense>

namespace weft::classifier::imprint {

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
