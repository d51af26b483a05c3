#pragma once
// What an SVM must at least lose on rows held out, known without solving it.

#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"

namespace weft::classifier {

/// Lower bound of the hinge loss of one fold's held-out rows, for every C and gamma. Of a positive
/// row p and a negative row n held out, hinge(p) + hinge(n) >= 2 - (f(p) - f(n)), and the bias is
/// gone from the difference, sum_i alpha_i y_i (K(p, i) - K(n, i)). It is small
///  - where the kernel is flat: 0 <= alpha <= C and |exp(-x) - exp(-y)| <= |x - y|;
///  - where the kernel is nearly the identity: every K(p, i) is small, and the multipliers have
///    sum(alpha) <= 2 n / (1 - r), r the largest sum of a row of K without its diagonal, because
///    the dual objective sum(alpha) - alpha Q alpha / 2 never falls below its start, 0.
class LossBound {
 public:
  /// `squared`: distances [(train + held out) x train]; signs of the rows in that order.
  LossBound(const Matrix& squared, std::span<const int> train, std::span<const int> held_out);

  /// At most the sum of max(0, 1 - y f) over the rows held out, less 1e-9 for rounding.
  [[nodiscard]] double least_loss(double c, double gamma) const;

 private:
  [[nodiscard]] double farthest_apart(double c, double gamma) const;

  double rows_;                // in training
  double nearest_train_;       // smallest squared distance between two training rows
  double nearest_across_;      // between a training row and one held out
  std::vector<double> reach_;  // per pair held out: sum_i max(0, y_i (D(n, i) - D(p, i)))
};

}  // namespace weft::classifier
