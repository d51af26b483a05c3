#pragma once
// One multi-class support vector machine on all features: the usual first attempt.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/learn/feature_view.hpp"
#include "classifier/learners/predictor.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// One-vs-one as in libsvm's C-SVC with a radial kernel: one C and one gamma for all pairs; the
/// lowest class wins a tie. The same model as libsvm (and scikit-learn's SVC) on the same scaled
/// rows. Only rows of two classes enter a pair's problem, so distances are computed once for all.
/// Immutable; may be used by several threads.
class MultiClassSvc final : public Predictor {
 public:
  /// The machine of one pair of classes; f > 0 is a vote for the second class.
  struct Machine {
    std::vector<std::size_t> row;  ///< rows of Parts::support
    std::vector<double> coefficient;
    double bias = 0.0;
  };
  /// All parameters of a prediction.
  struct Parts {
    Scaler scaler;
    Matrix support;                 ///< scaled training rows
    std::vector<Machine> machines;  ///< one per pair, in the order of all_pairs(classes)
    std::size_t classes = 0;
    double c = 0.0;
    double gamma = 0.0;
    std::size_t cv_errors = 0;
  };
  /// Chooses C and gamma from options.grid by the fewest errors over `folds` (then the smaller C,
  /// then the smaller gamma), with new scaling in each fold, and trains on all rows. Without folds
  /// it takes the grid's C nearest to 8 and gamma nearest to 1 / columns, by their logarithms. A
  /// scaled column then adds about one to the factor of gamma, whatever the number of columns.
  /// `of_row`: class of every row, below `classes`, each at least once in every training part.
  /// Values finite.
  static Result<MultiClassSvc> fit(const Matrix& rows, std::span<const std::size_t> of_row,
                                   std::size_t classes, std::span<const Fold> folds,
                                   const TrainOptions& options);

  /// Rebuilds a stored machine; rows of machines are below support.rows().
  explicit MultiClassSvc(Parts parts) : parts_(std::move(parts)) {}

  /// The class with most votes; the lowest wins a tie. Scores are the sums of tanh(f) of a class's
  /// machines, with the sign in favour of the class. Refuses a vector of another length, and one so
  /// far away that a decision is not finite.
  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const override;
  void keep_parameters(TrainOptions& options) const override;

  void write(LineWriter& out) const override;
  /// Reads the lines of write(); problems are recorded in `in`.
  static MultiClassSvc read(LineReader& in, std::size_t features, std::size_t classes);

  [[nodiscard]] double c() const { return parts_.c; }
  [[nodiscard]] double gamma() const { return parts_.gamma; }
  [[nodiscard]] std::size_t cv_errors() const { return parts_.cv_errors; }
  [[nodiscard]] const Parts& parts() const { return parts_; }

 private:
  Parts parts_;
};

}  // namespace weft::classifier
