#pragma once
// A weight vector per class; the largest inner product wins. What the perceptron, the minimum
// squared error rule and ridge regression leave behind, and whether any such rule can tell the
// classes apart.

#include <array>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/learn/feature_view.hpp"
#include "classifier/learners/predictor.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

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
class LinearRule final : public Predictor {
 public:
  /// `weight` [classes x (features + 1)] of scaled features; the last column is the bias.
  LinearRule(Scaler scaler, Matrix weight)
      : scaler_(std::move(scaler)),
        weight_(std::move(weight)),
        class_of_row_(numbers_below(weight_.rows())) {}
  /// `class_of_row`: whose weights a row has, each class once. Equal products go to the first row.
  LinearRule(Scaler scaler, Matrix weight, std::vector<std::size_t> class_of_row, FitReport report)
      : scaler_(std::move(scaler)),
        weight_(std::move(weight)),
        class_of_row_(std::move(class_of_row)),
        report_(report) {}

  /// Class of the largest inner product; the first of several. Refuses a vector of another length
  /// and one of which a product is not finite.
  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const override;
  void write(LineWriter& out) const override;
  /// What write() wrote; `in` keeps the first problem.
  static LinearRule read(LineReader& in, std::size_t features, std::size_t classes);
  [[nodiscard]] FitReport report() const override { return report_; }

  [[nodiscard]] const Scaler& scaler() const { return scaler_; }
  [[nodiscard]] const Matrix& weight() const { return weight_; }

 private:
  Scaler scaler_;
  Matrix weight_;
  std::vector<std::size_t> class_of_row_;
  FitReport report_ = {};
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

/// Penalties that train_ridge() chooses from, a row, largest first: half decades from 1e3 to 1e-6.
inline constexpr std::array ridge_penalties{1e3,  3e2,  1e2,  3e1,  1e1,  3e0,  1e0,
                                            3e-1, 1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4,
                                            1e-4, 3e-5, 1e-5, 3e-6, 1e-6};

struct RidgeOutcome {
  LinearRule rule;
  double penalty = 0;  ///< that was chosen: one of ridge_penalties times the rows
};

/// The same squares of z-scored features plus `penalty` times the squares of the weights, the bias
/// left out (ridge regression, Hoerl and Kennard 1970). The penalty, one for all classes, is that
/// with the least generalised cross-validation (Golub, Heath and Wahba 1979), the largest of
/// several: all of them come from one eigendecomposition. Refuses what check_training() refuses.
Result<RidgeOutcome> train_ridge(const Matrix& rows, std::span<const std::size_t> of_row,
                                 std::size_t classes);

// Whether classes are linearly separable at all, said next to a perceptron that stops after 1000
// rounds (choice E5).

enum class Separability {
  separable,      ///< proved: weights were found that take every row for its class
  not_separable,  ///< proved, to a margin of 1e-7: see separability()
  undecided       ///< the work allowed did not suffice
};
std::string_view to_string(Separability verdict);

struct SeparabilityOutcome {
  Separability verdict = Separability::undecided;
  /// Least distance from the origin that the hull was shown to keep, 0 where it has it inside.
  double margin = 0;
  std::size_t steps = 0;
};

/// Kesler's construction makes one vector of every row and wrong class; classes are separable if
/// and only if one direction has a positive product with all of them, that is if their convex hull
/// does not contain the origin. The hull's point nearest to the origin is found by Wolfe's
/// algorithm (Wolfe 1976, Mathematical Programming 11) on unit vectors of z-scored rows with a
/// bias: scaling changes nothing about separability. `separable` is checked row by row with the
/// weights found; `not_separable` is a convex combination of unit vectors that is at most 1e-7
/// long. Refuses what check_training() refuses.
Result<SeparabilityOutcome> separability(const Matrix& rows, std::span<const std::size_t> of_row,
                                         std::size_t classes, std::size_t most_steps = 20000);

}  // namespace weft::classifier
