#pragma once
// A weight vector per class; the largest inner product wins. It is the result of the perceptron,
// the minimum squared error rule and ridge regression. Also checks whether any such rule can
// separate the classes.

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

/// Scaling of features before a rule (choice E5).
enum class FeatureScaling {
  none,   ///< the default: the paper does not specify a scaling
  zscore  ///< zero mean, unit deviation of the training rows
};

/// Fits the scaler to `rows`; with FeatureScaling::none it changes nothing.
Scaler scaler_for(FeatureScaling scaling, const Matrix& rows);

/// Refuses `rows` that differ in number from `of_row`, no row, fewer than two classes, a class
/// number out of range, and values that are not finite or beyond 1e100.
Status check_training(const Matrix& rows, std::span<const std::size_t> of_row, std::size_t classes);

/// Immutable; may be used by several threads.
class LinearRule final : public Predictor {
 public:
  /// `weight` [classes x (features + 1)] for scaled features; the last column is the bias.
  LinearRule(Scaler scaler, Matrix weight)
      : scaler_(std::move(scaler)),
        weight_(std::move(weight)),
        class_of_row_(numbers_below(weight_.rows())) {}
  /// `class_of_row`: the class of each row of weights, each class once. The first row wins a tie.
  LinearRule(Scaler scaler, Matrix weight, std::vector<std::size_t> class_of_row, FitReport report)
      : scaler_(std::move(scaler)),
        weight_(std::move(weight)),
        class_of_row_(std::move(class_of_row)),
        report_(report) {}

  /// Class of the largest inner product; the first one wins a tie. Refuses a vector of another
  /// length and one with a non-finite product.
  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const override;
  void write(LineWriter& out) const override;
  /// Reads the lines of write(); problems are recorded in `in`.
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

/// Appends a last column of ones.
Matrix with_ones(const Matrix& rows);

// Kesler's construction of the multi-class perceptron (Ellis 1986, section 3.2, after Duda and
// Hart): the paper's learning rule.

struct KeslerOptions {
  FeatureScaling scaling = FeatureScaling::none;
  double c = 1.0;  ///< learning constant, above 0
  std::size_t most_rounds =
      1000;  ///< after this number the paper considers the training not converged
};

struct KeslerOutcome {
  LinearRule rule;  ///< if not converged: the rule after the last round
  bool converged = false;
  std::size_t rounds = 0;  ///< number of rounds over the data, including the one without a mistake
  std::size_t mistakes = 0;  ///< in the last round; 0 means converged
};

/// Weights start at zero; the rows come in their order, repeatedly. For a row of class i that is
/// predicted as class j, c times the row (and c for the bias) is added to i and subtracted from j
/// (choice E6). The lowest class wins a tie. Stops after the first round without a mistake. Refuses
/// what check_training() refuses, c that is not finite and above 0, no round.
Result<KeslerOutcome> train_kesler(const Matrix& rows, std::span<const std::size_t> of_row,
                                   std::size_t classes, const KeslerOptions& options);

/// Least-squares weights (Duda and Hart, section 5.12). The targets of the products with the rows,
/// with a one appended for the bias, are 1 for a row's own class and 0 for the others. With fewer
/// rows than features it takes the shortest such weights. Refuses what check_training() refuses.
Result<LinearRule> train_least_squares(const Matrix& rows, std::span<const std::size_t> of_row,
                                       std::size_t classes, FeatureScaling scaling);

/// Candidate penalties per row for train_ridge(), largest first: half decades from 1e3 to 1e-6.
inline constexpr std::array ridge_penalties{1e3,  3e2,  1e2,  3e1,  1e1,  3e0,  1e0,
                                            3e-1, 1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4,
                                            1e-4, 3e-5, 1e-5, 3e-6, 1e-6};

struct RidgeOutcome {
  LinearRule rule;
  double penalty = 0;  ///< the chosen penalty: one of ridge_penalties times the number of rows
};

/// The same squares of z-scored features plus `penalty` times the squares of the weights without
/// the bias (ridge regression, Hoerl and Kennard 1970). All classes share the penalty. It has the
/// least generalised cross-validation (Golub, Heath and Wahba 1979); the largest one wins a tie.
/// One eigendecomposition serves all penalties. Refuses what check_training() refuses.
Result<RidgeOutcome> train_ridge(const Matrix& rows, std::span<const std::size_t> of_row,
                                 std::size_t classes);

// Whether classes are linearly separable at all. Reported beside a perceptron that stops after 1000
// rounds (choice E5).

enum class Separability {
  separable,      ///< proved: the weights found predict every row right
  not_separable,  ///< proved, to a margin of 1e-7: see separability()
  undecided       ///< the allowed number of steps did not suffice
};
std::string_view to_string(Separability verdict);

struct SeparabilityOutcome {
  Separability verdict = Separability::undecided;
  /// Proved lower bound of the hull's distance from the origin; 0 if the hull contains it.
  double margin = 0;
  std::size_t steps = 0;
};

/// Kesler's construction makes one vector of every row and wrong class. The classes are separable
/// if and only if one direction has a positive product with all vectors, that is if their convex
/// hull does not contain the origin. Wolfe's algorithm finds the hull's point nearest to the origin
/// (Wolfe 1976, Mathematical Programming 11). It uses unit vectors of z-scored rows with a bias;
/// scaling does not change separability. `separable` is verified row by row with the weights found.
/// `not_separable` is a convex combination of unit vectors that is at most 1e-7 long. Refuses what
/// check_training() refuses.
Result<SeparabilityOutcome> separability(const Matrix& rows, std::span<const std::size_t> of_row,
                                         std::size_t classes, std::size_t most_steps = 20000);

}  // namespace weft::classifier
