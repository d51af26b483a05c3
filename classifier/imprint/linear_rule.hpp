#pragma once
// A weight vector per class; the largest inner product wins. What the perceptron and the minimum
// squared error rule leave behind.

#include <cstddef>
#include <span>

#include "classifier/base/matrix.hpp"
#include "classifier/learn/scaler.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::imprint {

/// What is done to features before a rule sees them (choice E5).
enum class FeatureScaling {
  none,   ///< the paper, which says nothing of it
  zscore  ///< zero mean, unit deviation of the training rows
};

/// Scales as learnt from `rows`, or leaves as it is.
Scaler scaler_for(FeatureScaling scaling, const Matrix& rows);

/// Refuses rows that are not `of_row.size()`, no row, no or one class, a class number that is not
/// below `classes`, and values that are not finite or beyond 1e100.
Status check_training(const Matrix& rows, std::span<const std::size_t> of_row, std::size_t classes);

/// Immutable; may be used by several threads.
class LinearRule {
 public:
  /// `weight` [classes x (features + 1)] of scaled features; the last column is the bias.
  LinearRule(Scaler scaler, Matrix weight)
      : scaler_(std::move(scaler)), weight_(std::move(weight)) {}

  /// Class of the largest inner product; the lowest of several. Refuses a vector of another length
  /// and one of which a product is not finite.
  [[nodiscard]] Result<std::size_t> classify(std::span<const double> features) const;

  [[nodiscard]] const Scaler& scaler() const { return scaler_; }
  [[nodiscard]] const Matrix& weight() const { return weight_; }

 private:
  Scaler scaler_;
  Matrix weight_;
};

/// Rows with a last column of ones.
Matrix with_ones(const Matrix& rows);

// Kesler's construction of the multi-class perceptron (Ellis 1986, section 3.2, after Duda and
// Hart): the paper's learning rule.

struct KeslerOptions {
  FeatureScaling scaling = FeatureScaling::none;
  double c = 1.0;                  ///< learning constant, above 0
  std::size_t most_rounds = 1000;  ///< then convergence has failed, says the paper
};

struct KeslerOutcome {
  LinearRule rule;  ///< where it did not converge: as the last round left it
  bool converged = false;
  std::size_t rounds = 0;    ///< over the data, the clean one included
  std::size_t mistakes = 0;  ///< in the last round; 0 means converged
};

/// Weights start at zero; rows come in their order, again and again; a row of class i that is taken
/// for class j adds c times itself, and c for the bias, to i and takes it from j (choice E6). Equal
/// products go to the lowest class. Stops after the first round without a mistake. Refuses what
/// check_training() refuses, c that is not finite and above 0, no round.
Result<KeslerOutcome> train_kesler(const Matrix& rows, std::span<const std::size_t> of_row,
                                   std::size_t classes, const KeslerOptions& options);

/// Weights whose products with the rows, a one for the bias appended, are nearest to 1 for a row's
/// own class and 0 for the others in the sum of squares (Duda and Hart, section 5.12); the shortest
/// of them where rows are fewer than features. Refuses what check_training() refuses.
Result<LinearRule> train_least_squares(const Matrix& rows, std::span<const std::size_t> of_row,
                                       std::size_t classes, FeatureScaling scaling);

}  // namespace weft::classifier::imprint
