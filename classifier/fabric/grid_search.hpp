#pragma once
// Joint choice of C, gamma and delta of one core by cross-validation: section III-D of Khan et al.
// 2016.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/fabric/options.hpp"
#include "classifier/fabric/reducer.hpp"
#include "classifier/features/matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Validation result of one grid point, summed over the folds.
struct GridScore {
  std::size_t errors = 0;
  double loss = 0.0;  ///< hinge loss: sum of max(0, 1 - y f)
};

/// Scores of all points and the chosen one. `member` counts deltas (or explained shares).
struct GridResult {
  std::vector<GridScore> scores;  ///< [members x gammas x Cs]
  std::size_t member = 0;
  std::size_t gamma = 0;
  std::size_t c = 0;
  GridScore best;
  std::size_t fits = 0;  ///< SVMs actually solved; shared problems count once
};

/// `full` is the reducer learnt from all `rows`; with options.nested every fold learns its own.
/// Refuses folds that name a row beyond the last, leave a class without a training row, or leave
/// fewer than three rows where p-values are nested.
Result<GridResult> search_grid(const Matrix& rows, std::span<const int> sign, const Reducer& full,
                               std::span<const Fold> folds, const TrainOptions& options);

}  // namespace weft::classifier
