#pragma once
// A trained predictor: gives the class of a row of features.

#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "classifier/base/line_io.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/fabric/model.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Prediction for one row.
struct ClassScores {
  std::size_t winner = 0;  ///< class number
  /// Per class, larger is likelier: ln of a probability up to a constant, or a margin instead.
  /// Calibration starts from their softmax.
  std::vector<double> score;
  std::vector<int> votes = {};  ///< per class; empty without a vote
};

/// Course of a training, for learners that repeat the data until they make no mistake.
struct FitReport {
  bool converged = true;
  std::size_t rounds =
      0;  ///< rounds over the data, including the one without a mistake; 0: not counted
};

/// Immutable; may be used by several threads. Class numbers are indices into the sorted labels.
class Predictor {
 public:
  Predictor() = default;
  Predictor(const Predictor&) = default;
  Predictor(Predictor&&) = default;
  Predictor& operator=(const Predictor&) = default;
  Predictor& operator=(Predictor&&) = default;
  virtual ~Predictor() = default;

  /// Predicts a row with as many features as in the training, all finite. Refuses one so far away
  /// that a score is not finite.
  [[nodiscard]] virtual Result<ClassScores> predict(std::span<const double> row) const = 0;
  /// Only the winner, by the fastest way.
  [[nodiscard]] virtual Result<std::size_t> classify(std::span<const double> row) const;
  /// Writes the trained parameters as lines of a stored model.
  virtual void write(LineWriter& out) const = 0;
  /// Columns that a prediction depends on, ascending; empty: all. Others may have any finite value.
  [[nodiscard]] virtual std::vector<std::size_t> used_columns() const { return {}; }
  /// nullptr if there are none.
  [[nodiscard]] virtual const FabricModel* cores() const { return nullptr; }
  /// Narrows the grid to the chosen parameters, so that the next training keeps them.
  virtual void keep_parameters(TrainOptions& /*options*/) const {}
  [[nodiscard]] virtual FitReport report() const { return {}; }
};
using PredictorPtr = std::unique_ptr<const Predictor>;

/// Reads the lines of write() of an `Own`, for rows of `features` features. Problems are recorded
/// in `in`; the result is then null.
template <class Own>
PredictorPtr read_as(LineReader& in, std::size_t features, std::size_t classes) {
  Own out = Own::read(in, features, classes);
  if (!in.ok()) return nullptr;
  return std::make_unique<Own>(std::move(out));
}

/// Input of a learner: training rows after the view, and their classes.
struct TrainingSet {
  const FeatureMatrix& matrix;
  const Classes& known;

  [[nodiscard]] const Matrix& rows() const { return matrix.values; }
  [[nodiscard]] std::span<const std::size_t> of_row() const { return known.of_row; }
  [[nodiscard]] std::size_t classes() const { return known.labels.size(); }
};

}  // namespace weft::classifier
