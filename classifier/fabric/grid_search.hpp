#pragma once
// Joint choice of C, gamma and delta of one core by cross-validation: section III-D of Khan et al.
// 2016.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/fabric/fold_problem.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/fabric/reducer.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// The chosen point. `member` counts deltas (or explained shares).
struct GridResult {
  std::vector<GridScore> scores;  ///< [members x gammas x Cs]; none with Search::fast
  std::size_t member = 0;
  std::size_t gamma = 0;
  std::size_t c = 0;
  GridScore best;
  std::size_t fits = 0;  ///< SVMs actually solved; shared problems count once
};

/// One object per thread; it keeps its memory from core to core.
class GridSearch {
 public:
  /// `full` is the reducer learnt from all `rows`; with options.nested every fold learns its own.
  /// Refuses folds that name a row beyond the last, leave a class without a training row, or leave
  /// fewer than three rows where p-values are nested.
  Result<GridResult> run(const Matrix& rows, std::span<const int> sign, const Reducer& full,
                         std::span<const Fold> folds, const TrainOptions& options,
                         const RareT& rare = RareT());

 private:
  std::vector<FoldProblem> problems_;
};

}  // namespace weft::classifier
