#pragma once
// Something trained: says of a row of features to which class it belongs.

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

/// What a predictor says of one row.
struct ClassScores {
  std::size_t winner = 0;  ///< class number
  /// Per class, larger is likelier: up to a constant ln of a probability, or a margin that stands
  /// for one. Their softmax is what calibration begins with.
  std::vector<double> score;
  std::vector<int> votes = {};  ///< per class; empty where nothing votes
};

/// How a training went, of learners that go over the data until they make no mistake.
struct FitReport {
  bool converged = true;
  std::size_t rounds = 0;  ///< over the data, the clean one included; 0: does not count them
};

/// Immutable; may be used by several threads. Class numbers are places in the sorted labels.
class Predictor {
 public:
  Predictor() = default;
  Predictor(const Predictor&) = default;
  Predictor(Predictor&&) = default;
  Predictor& operator=(const Predictor&) = default;
  Predictor& operator=(Predictor&&) = default;
  virtual ~Predictor() = default;

  /// Of a row of as many features as the training had, all finite. Refuses one so far away that a
  /// score is not finite.
  [[nodiscard]] virtual Result<ClassScores> predict(std::span<const double> row) const = 0;
  /// The winner alone, by the shortest way.
  [[nodiscard]] virtual Result<std::size_t> classify(std::span<const double> row) const;
  /// What was learnt as lines of a stored model.
  virtual void write(LineWriter& out) const = 0;
  /// Columns that an answer depends on, ascending; empty: all. Others may have any finite value.
  [[nodiscard]] virtual std::vector<std::size_t> used_columns() const { return {}; }
  /// nullptr where there are none.
  [[nodiscard]] virtual const FabricModel* cores() const { return nullptr; }
  /// Narrows the grid to the parameters that were chosen, so that a further training keeps them.
  virtual void keep_parameters(TrainOptions& /*options*/) const {}
  [[nodiscard]] virtual FitReport report() const { return {}; }
};
using PredictorPtr = std::unique_ptr<const Predictor>;

/// What write() of an `Own` wrote, of rows of so many features. `in` keeps the first problem; null
/// then.
template <class Own>
PredictorPtr read_as(LineReader& in, std::size_t features, std::size_t classes) {
  Own out = Own::read(in, features, classes);
  if (!in.ok()) return nullptr;
  return std::make_unique<Own>(std::move(out));
}

/// All that a learner is given: training rows, as it is to see them, and their classes.
struct TrainingSet {
  const FeatureMatrix& matrix;
  const Classes& known;

  [[nodiscard]] const Matrix& rows() const { return matrix.values; }
  [[nodiscard]] std::span<const std::size_t> of_row() const { return known.of_row; }
  [[nodiscard]] std::size_t classes() const { return known.labels.size(); }
};

}  // namespace weft::classifier
