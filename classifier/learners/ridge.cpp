#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "classifier/learners/linear_rule.hpp"

namespace weft::classifier {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Squared singular values below this share of the largest are zero up to rounding.
constexpr double ridge_rank = 1e-13;

// Centred rows X and targets Y, and the eigenvectors of the smaller of X'X and XX'.
class RidgePath {
 public:
  RidgePath(MatrixXd rows, MatrixXd targets)
      : rows_(std::move(rows)), targets_(std::move(targets)) {
    is_wide_ = rows_.cols() > rows_.rows();
    const MatrixXd gram =
        is_wide_ ? MatrixXd(rows_ * rows_.transpose()) : MatrixXd(rows_.transpose() * rows_);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(gram);
    const VectorXd& all = solver.eigenvalues();  // ascending
    const Index rank = all.size() == 0 || !(all(all.size() - 1) > 0.0)
                           ? 0
                           : (all.array() > ridge_rank * all(all.size() - 1)).count();
    squares_ = all.tail(rank);
    vectors_ = solver.eigenvectors().rightCols(rank);
    projected_ =
        vectors_.transpose() * (is_wide_ ? targets_ : MatrixXd(rows_.transpose() * targets_));
  }

  /// [features x classes]
  [[nodiscard]] MatrixXd weights(double penalty) const {
    const VectorXd inverse = (squares_.array() + penalty).inverse();
    const MatrixXd shrunk = vectors_ * (inverse.asDiagonal() * projected_);
    return is_wide_ ? rows_.transpose() * shrunk : shrunk;
  }

  /// Mean squared residual over the square of the remaining share of degrees of freedom (Golub,
  /// Heath and Wahba 1979), for all classes together. The mean of the targets takes one degree.
  [[nodiscard]] double score(double penalty) const {
    const auto n = static_cast<double>(rows_.rows());
    const double outside = std::max(n - 1.0 - static_cast<double>(squares_.size()), 0.0);
    const double left = outside + (penalty / (squares_.array() + penalty)).sum();
    return n * (targets_ - rows_ * weights(penalty)).squaredNorm() / (left * left);
  }

 private:
  MatrixXd rows_, targets_;
  bool is_wide_ = false;
  VectorXd squares_;
  MatrixXd vectors_, projected_;
};

}  // namespace

Result<RidgeOutcome> train_ridge(const Matrix& rows, std::span<const std::size_t> of_row,
                                 std::size_t classes) {
  if (auto ok = check_training(rows, of_row, classes); !ok) return pass(ok.error(), "ridge");
  Scaler scaler = fit_scaler(rows);
  const Matrix inputs = scaled(scaler, rows);
  const auto index = [](std::size_t i) { return static_cast<Index>(i); };
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  MatrixXd x =
      Eigen::Map<const RowMajor>(inputs.data().data(), index(inputs.rows()), index(inputs.cols()));
  MatrixXd targets = MatrixXd::Zero(index(rows.rows()), index(classes));
  for (std::size_t r = 0; r < of_row.size(); ++r) targets(index(r), index(of_row[r])) = 1.0;
  const Eigen::RowVectorXd middle = x.colwise().mean(), share = targets.colwise().mean();
  x.rowwise() -= middle;  // removes the rounding of the scaler
  targets.rowwise() -= share;
  const RidgePath path(std::move(x), std::move(targets));
  double best = std::numeric_limits<double>::infinity(), penalty = 0.0;
  for (const double each : ridge_penalties) {
    const double own = each * static_cast<double>(rows.rows());
    const double score = path.score(own);
    if (penalty != 0.0 && !(score < best)) continue;
    best = score;
    penalty = own;
  }
  const MatrixXd solution = path.weights(penalty);
  const Eigen::RowVectorXd bias = share - middle * solution;
  if (!solution.allFinite() || !bias.allFinite())
    return fail({.code = Errc::range, .where = "ridge", .what = "squared error not minimised"});
  Matrix weight(classes, inputs.cols() + 1);
  for (std::size_t c = 0; c < classes; ++c) {
    for (std::size_t k = 0; k < inputs.cols(); ++k) weight(c, k) = solution(index(k), index(c));
    weight(c, inputs.cols()) = bias(index(c));
  }
  return RidgeOutcome{LinearRule(std::move(scaler), std::move(weight)), penalty};
}

}  // namespace weft::classifier
