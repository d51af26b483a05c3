#pragma once
// Linear discriminant analysis with automatic shrinkage: the simple learner that cores must beat.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/learn/feature_view.hpp"
#include "classifier/learners/predictor.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Share of the identity in a covariance, 0 to 1, that minimises the expected squared error of the
/// estimate (Ledoit and Wolf 2004, J. Multivariate Analysis 88). `rows` are centred; at least one.
double ledoit_wolf_shrinkage(const Matrix& rows);

/// One covariance for all classes: the mean of the classes' own shrunk covariances, weighted by the
/// classes' shares. Each is shrunk in the units of its own deviations. Features are first scaled to
/// unit deviation. The same as scikit-learn's StandardScaler and
/// LinearDiscriminantAnalysis(solver='lsqr', shrinkage='auto'), if the covariance is regular.
/// Columns without any spread have no effect; if no class has any spread the nearest mean wins.
/// Immutable; may be used by several threads.
class ShrinkageLda final : public Predictor {
 public:
  /// `of_row`: class of every row, below `classes`, each at least once. Values finite.
  static Result<ShrinkageLda> fit(const Matrix& rows, std::span<const std::size_t> of_row,
                                  std::size_t classes);

  /// Rebuilds a stored one: `weight` [classes x features] for scaled features, a `bias` per class.
  ShrinkageLda(Scaler scaler, Matrix weight, std::vector<double> bias)
      : scaler_(std::move(scaler)), weight_(std::move(weight)), bias_(std::move(bias)) {}

  /// Per class: ln(p(features | class) p(class)) up to a constant, all finite. Refuses a vector of
  /// another length, and one so far away that a discriminant is not finite.
  [[nodiscard]] Result<std::vector<double>> discriminants(std::span<const double> features) const;
  /// Class of the largest discriminant; the lowest class wins a tie.
  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const override;

  void write(LineWriter& out) const override;
  /// Reads the lines of write(); problems are recorded in `in`.
  static ShrinkageLda read(LineReader& in, std::size_t features, std::size_t classes);

  [[nodiscard]] const Scaler& scaler() const { return scaler_; }
  [[nodiscard]] const Matrix& weight() const { return weight_; }
  [[nodiscard]] const std::vector<double>& bias() const { return bias_; }

 private:
  ShrinkageLda() = default;

  Scaler scaler_;
  Matrix weight_;
  std::vector<double> bias_;
};

}  // namespace weft::classifier
