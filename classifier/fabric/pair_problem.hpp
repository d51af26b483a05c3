#pragma once
// The training rows of one core, their signs and the folds of its cross-validation.

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "classifier/fabric/fold_units.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/features/feature_matrix.hpp"

namespace weft::classifier {

using RowsOfLabel = std::map<std::string, std::vector<std::size_t>>;

/// Row numbers of every label, ascending.
RowsOfLabel rows_by_label(const FeatureMatrix& matrix);

/// Of every training row. Refuses fewer than two labels, and one of a single row.
Status check_labels(std::span<const std::string> labels);

/// What a core learns from: `sign` and `folds` count positions in `rows`.
struct PairProblem {
  std::vector<std::size_t> rows;  ///< of the matrix: class a, then class b
  std::vector<int> sign;          ///< +1 for class a, -1 for class b
  std::vector<Fold> folds;        ///< of options.make_folds, or stratified by units_by_label()
};

/// Pair after pair of one matrix. Folds depend on the pattern of signs and units alone, so those of
/// the last pair serve the next one of the same pattern.
class PairMaker {
 public:
  /// `options` is kept by reference.
  PairMaker(const FeatureMatrix& matrix, const TrainOptions& options);
  /// Row numbers of the two classes. What it returns is good until the next call.
  const PairProblem& make(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b);

 private:
  [[nodiscard]] std::vector<std::size_t> pattern(const std::vector<std::size_t>& rows) const;

  const TrainOptions& options_;
  std::vector<std::size_t> unit_;  // per row of the matrix
  std::vector<std::size_t> last_pattern_;
  std::vector<int> last_sign_;
  PairProblem problem_;
};

}  // namespace weft::classifier
