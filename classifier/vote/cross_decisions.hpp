#pragma once
// What the cores say of training trials that they have not seen: calibration and reject rule are
// learnt from these, never from the fit of the training trials themselves.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/fabric/model.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Decisions on training rows, each by a core that was trained without the row.
struct CrossDecisions {
  std::vector<std::size_t> own;  ///< per row: its class
  /// [rows x classes]: f of the core of the row's own class against the column's, positive in
  /// favour of the own class; 0 in the own column.
  Matrix against;

  /// [rows asked about x cores]: all cores' decisions, in the order of model.pairs(), held out
  /// where a row's own class takes part; the other cores have never seen it. `values` of the
  /// training.
  [[nodiscard]] Matrix of_rows(const FabricModel& model, const Matrix& values,
                               std::span<const std::size_t> rows, std::size_t threads = 0) const;
};

/// Trains every core again on each of its folds with the parameters that it chose, and asks it for
/// the rows held out. `matrix` and `options` are those of the training: the folds come out the
/// same. A row that no fold holds out keeps 0. Features are chosen inside each fold. Refuses other
/// columns or labels than the model's.
Result<CrossDecisions> cross_decisions(const FabricModel& model, const FeatureMatrix& matrix,
                                       const TrainOptions& options);

}  // namespace weft::classifier
