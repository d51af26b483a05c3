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

}  // namespace weft::classifier::imprint
