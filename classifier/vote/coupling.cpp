#include "classifier/vote/coupling.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "classifier/vote/vote.hpp"

namespace weft::classifier {
namespace {

constexpr double least = 1e-7;  // as libsvm clips

// Q of equation 21: q_tt = sum of r_st^2 over s, q_tj = -r_jt r_tj.
Eigen::MatrixXd objective(std::span<const double> first_wins, std::size_t classes) {
  const auto n = static_cast<Eigen::Index>(classes);
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(n, n);
  std::size_t pair = 0;
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = a + 1; b < n; ++b) {
      const double r = std::clamp(first_wins[pair++], least, 1.0 - least);
      q(a, a) += (1.0 - r) * (1.0 - r);
      q(b, b) += r * r;
      q(a, b) = q(b, a) = -r * (1.0 - r);
    }
  }
  return q;
}

}  // namespace

// The conditions of the minimum are Q p = -b e, e'p = 1. Hence (Q + d e e') p = (d - b) e for every
// d: p is the normalised solution of one system that is positive definite (theorem 2 and its
// appendix), where libsvm iterates.
std::vector<double> couple(std::span<const double> first_wins, std::size_t classes) {
  WEFT_ASSERT(classes >= 2 && first_wins.size() == classes * (classes - 1) / 2);
  Eigen::MatrixXd q = objective(first_wins, classes);
  const auto n = static_cast<Eigen::Index>(classes);
  q.array() += q.diagonal().maxCoeff();
  const Eigen::VectorXd solution = q.ldlt().solve(Eigen::VectorXd::Ones(n));
  std::vector<double> p(classes);
  double sum = 0.0;
  for (std::size_t k = 0; k < classes; ++k) {
    p[k] = std::max(0.0, solution[static_cast<Eigen::Index>(k)]);
    sum += p[k];
  }
  if (!(sum > 0.0 && std::isfinite(sum)))
    return std::vector<double>(classes, 1.0 / static_cast<double>(classes));
  for (double& value : p) value /= sum;
  return p;
}

}  // namespace weft::classifier
