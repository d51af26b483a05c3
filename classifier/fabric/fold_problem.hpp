#pragma once
// One fold of a core's cross-validation: every SVM of the grid on its training rows, scored on the
// rows held out.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/fabric/loss_bound.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/fabric/reducer.hpp"
#include "classifier/features/matrix.hpp"
#include "classifier/learn/svm_solver.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Validation result of one grid point, of one fold or summed over the folds.
struct GridScore {
  std::size_t errors = 0;
  double loss = 0.0;  ///< hinge loss: sum of max(0, 1 - y f)
};

/// Solves on demand and remembers. Grid members that come to the same number of directions are one
/// problem; distances are shared by all gammas; a solution that never touched C serves every
/// larger C.
class FoldProblem {
 public:
  /// `reducer` has been learnt from the training rows of this fold or from all rows.
  FoldProblem(const Matrix& rows, std::span<const int> sign, const Reducer& reducer,
              const Fold& fold, const TrainOptions& options);

  /// The number of directions that a grid member uses.
  [[nodiscard]] std::size_t size_of(std::size_t member) const { return sizes_[member]; }
  /// Score of grid.c[c] and grid.gamma[gamma] with a member's directions.
  Result<GridScore> score(std::size_t member, std::size_t gamma, std::size_t c);
  /// A lower bound of that score's loss, without solving anything.
  [[nodiscard]] double least_loss(std::size_t member, std::size_t gamma, std::size_t c) const {
    return bounds_[slot_of_[member]].least_loss(options_->grid.c[c], options_->grid.gamma[gamma]);
  }
  /// SVMs actually solved.
  [[nodiscard]] std::size_t fits() const { return fits_; }

 private:
  struct Distances {
    std::size_t size = 0;  // directions
    Matrix squared;        // [(train + validate) x train]
  };
  struct Remembered {
    GridScore score;
    bool known = false;
  };
  void measure(const Matrix& projected, std::span<const int> train_sign);
  Status use_kernel(std::size_t slot, std::size_t gamma);
  [[nodiscard]] GridScore validate() const;
  Remembered& remembered(std::size_t slot, std::size_t gamma, std::size_t c);

  const TrainOptions* options_;
  std::vector<std::size_t> sizes_;    // per member
  std::vector<std::size_t> slot_of_;  // per member: where its distances are
  std::vector<Distances> distances_;  // one per distinct size, growing
  std::vector<LossBound> bounds_;     // per distances
  std::vector<int> sign_;             // of the rows held out
  SvmSolver solver_;
  Matrix kernel_;  // [(train + validate) x train] of the problem that the solver holds
  std::size_t held_slot_, held_gamma_;
  std::vector<Remembered> scores_;
  std::size_t fits_ = 0;
};

}  // namespace weft::classifier
