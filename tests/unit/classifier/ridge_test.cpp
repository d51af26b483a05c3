// Ridge regression on indicators: weights and penalty compared with those of the normal equations,
// solved here for one penalty after the other; also columns without spread.

#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>

#include "classifier/learners/linear_rule.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::ridge_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

struct Direct {
  MatrixXd weight;  // [features + 1 x classes] of z-scored features, the bias last
  double penalty = 0, score = std::numeric_limits<double>::infinity();
};

// z-scored, a last column of ones; a column without spread is zeros.
MatrixXd standardised(const Matrix& rows) {
  MatrixXd out(static_cast<Index>(rows.rows()), static_cast<Index>(rows.cols()) + 1);
  for (Index r = 0; r < out.rows(); ++r)
    for (Index k = 0; k < out.cols(); ++k)
      out(r, k) = k + 1 == out.cols()
                      ? 1.0
                      : rows(static_cast<std::size_t>(r), static_cast<std::size_t>(k));
  for (Index k = 0; k + 1 < out.cols(); ++k) {
    out.col(k).array() -= out.col(k).mean();
    const double deviation = std::sqrt(out.col(k).squaredNorm() / static_cast<double>(out.rows()));
    if (deviation > 1e-12) out.col(k) /= deviation;
  }
  return out;
}

Direct by_normal_equations(const Matrix& rows, const std::vector<std::size_t>& of_row,
                           std::size_t classes) {
  const MatrixXd x = standardised(rows);
  MatrixXd y = MatrixXd::Zero(x.rows(), static_cast<Index>(classes));
  for (std::size_t r = 0; r < of_row.size(); ++r)
    y(static_cast<Index>(r), static_cast<Index>(of_row[r])) = 1.0;
  const auto n = static_cast<double>(x.rows());
  Direct out;
  for (const double penalty : ridge_penalties) {
    MatrixXd normal = x.transpose() * x;
    normal.diagonal().head(normal.rows() - 1).array() += n * penalty;
    const MatrixXd solved = normal.ldlt().solve(x.transpose());
    const double left = n - (x * solved).trace();
    const double score = n * (y - x * solved * y).squaredNorm() / (left * left);
    if (score < out.score) out = {solved * y, n * penalty, score};
  }
  return out;
}

struct Rows {
  Matrix values;
  std::vector<std::size_t> of_row;
};

Rows three_classes(std::size_t count, std::size_t features, double apart, std::uint64_t seed) {
  RandomEngine engine(seed);
  Rows out{Matrix(count, features), {}};
  for (std::size_t r = 0; r < count; ++r) {
    out.of_row.push_back(r % 3);
    for (std::size_t k = 0; k < features; ++k)
      out.values(r, k) =
          10.0 * static_cast<double>(k) + testing::normal(engine) + (k % 3 == r % 3 ? apart : 0.0);
  }
  return out;
}

void check_as_direct(const Rows& rows) {
  const auto got = train_ridge(rows.values, rows.of_row, 3);
  REQUIRE(got);
  const Direct want = by_normal_equations(rows.values, rows.of_row, 3);
  CHECK(got->penalty == Approx(want.penalty));
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t k = 0; k <= rows.values.cols(); ++k)
      CHECK(got->rule.weight()(c, k) ==
            Approx(want.weight(static_cast<Index>(k), static_cast<Index>(c)))
                .margin(1e-8)
                .epsilon(1e-6));
}

TEST_CASE("Ridge weights and their penalty are those of the normal equations") {
  check_as_direct(three_classes(60, 5, 2.0, 1));
  check_as_direct(three_classes(60, 5, 0.0, 2));   // nothing to learn
  check_as_direct(three_classes(12, 40, 3.0, 3));  // more features than rows
  check_as_direct(three_classes(31, 30, 1.0, 4));  // equally many
  check_as_direct(three_classes(20, 1, 4.0, 5));
  Rows flat = three_classes(45, 4, 2.0, 6);
  for (std::size_t r = 0; r < 45; ++r) flat.values(r, 2) = 7.0;
  check_as_direct(flat);
  Rows twice = three_classes(45, 6, 2.0, 7);  // a duplicate column
  for (std::size_t r = 0; r < 45; ++r) twice.values(r, 5) = -3.0 * twice.values(r, 0);
  check_as_direct(twice);
}

TEST_CASE("One column of ridge regression, worked out by hand") {
  // z = (-1, -1, 1, 1), indicators 0, 0, 1, 1: slope 2 / (4 + penalty). Residual of class 1: 4 (1/2
  // - slope)^2; remaining degrees of freedom: 2 + penalty / (4 + penalty). Both shrink to 0 with
  // the penalty.
  Matrix rows(4, 1);
  rows(2, 0) = rows(3, 0) = 5.0;
  const auto got = train_ridge(rows, std::vector<std::size_t>{0, 0, 1, 1}, 2);
  REQUIRE(got);
  CHECK(got->penalty == Approx(4e-6));
  CHECK(got->rule.weight()(1, 0) == Approx(2.0 / (4.0 + 4e-6)).epsilon(1e-12));
  CHECK(got->rule.weight()(1, 1) == Approx(0.5));
  CHECK(got->rule.weight()(0, 0) == Approx(-got->rule.weight()(1, 0)));
}

TEST_CASE("Rows that nothing tells apart go to the class that is most frequent") {
  const Matrix rows(5, 3, 2.0);
  const auto got = train_ridge(rows, std::vector<std::size_t>{0, 1, 1, 0, 1}, 2);
  REQUIRE(got);
  CHECK(got->penalty == Approx(5.0 * ridge_penalties.front()));
  CHECK(got->rule.weight()(0, 3) == Approx(0.4));
  CHECK(*got->rule.classify(std::vector{2.0, 2.0, 2.0}) == 1);
  const auto one = train_ridge(Matrix(1, 2, 3.0), std::vector<std::size_t>{1}, 2);
  REQUIRE(one);
  CHECK(*one->rule.classify(std::vector{0.0, 0.0}) == 1);
}

TEST_CASE("Ridge refuses what no rule can learn from") {
  Matrix bad(2, 1);
  bad(0, 0) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(train_ridge(bad, std::vector<std::size_t>{0, 1}, 2));
  CHECK_FALSE(train_ridge(Matrix(2, 1), std::vector<std::size_t>{0, 1}, 1));
  CHECK_FALSE(train_ridge(Matrix(2, 1), std::vector<std::size_t>{0}, 2));
}

}  // namespace
}  // namespace weft::classifier::ridge_test
