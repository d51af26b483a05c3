#pragma once
// Joint choice of C, gamma and delta of one core by cross-validation: section III-D of Khan et al.
// 2016.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/fabric/reducer.hpp"
#include "classifier/learn/svm_solver.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

// One fold of a core's cross-validation: every SVM of the grid on its training rows, scored on the
// held-out rows.

/// Lower bound of the hinge loss of one fold's held-out rows, for every C and gamma. For a positive
/// row p and a negative row n held out, hinge(p) + hinge(n) >= 2 - (f(p) - f(n)). The bias cancels
/// in the difference sum_i alpha_i y_i (K(p, i) - K(n, i)). The difference is small
/// - where the kernel is flat: 0 <= alpha <= C and |exp(-x) - exp(-y)| <= |x - y|;
/// - where the kernel is nearly the identity: every K(p, i) is small, and the multipliers have
///   sum(alpha) <= 2 n / (1 - r), with r the largest sum of a row of K without its diagonal.
///   This holds because the dual objective sum(alpha) - alpha Q alpha / 2 never falls below its
///   start, 0.
class LossBound {
 public:
  /// `squared`: distances [(train + held out) x train]; signs of the rows in that order.
  LossBound(const Matrix& squared, std::span<const int> train, std::span<const int> held_out);

  /// Lower bound of the sum of max(0, 1 - y f) over the held-out rows, less 1e-9 for rounding.
  [[nodiscard]] double least_loss(double c, double gamma) const;

 private:
  [[nodiscard]] double farthest_apart(double c, double gamma) const;

  double rows_;            // number of training rows
  double nearest_train_;   // smallest squared distance between two training rows
  double nearest_across_;  // smallest squared distance between a training row and a held-out row
  std::vector<double> reach_;  // per held-out pair: sum_i max(0, y_i (D(n, i) - D(p, i)))
};

/// A point of the grid: indices of the member (delta or explained share), gamma and C.
struct GridPoint {
  std::size_t member = 0, gamma = 0, c = 0;
};

/// Validation result of one grid point, for one fold or summed over the folds.
struct GridScore {
  std::size_t errors = 0;
  double loss = 0.0;  ///< hinge loss: sum of max(0, 1 - y f)
};

/// Solves SVMs on demand and caches the scores. Grid members with the same number of directions are
/// one problem. All gammas share the distances. A solution with all multipliers below C serves
/// every larger C.
class FoldProblem {
 public:
  /// `reducer` was fitted to the training rows of this fold or to all rows. Discards the previous
  /// fold, but keeps its memory.
  void reset(const Matrix& rows, std::span<const int> sign, const Reducer& reducer,
             const Fold& fold, const TrainOptions& options);

  /// The number of directions that a grid member uses.
  [[nodiscard]] std::size_t size_of(std::size_t member) const { return sizes_[member]; }
  Result<GridScore> score(const GridPoint& at);
  /// A lower bound of a score's loss, without solving anything.
  [[nodiscard]] double least_loss(const GridPoint& at) const {
    return bounds_[slot_of_[at.member]].least_loss(options_->grid.c[at.c],
                                                   options_->grid.gamma[at.gamma]);
  }
  /// Number of SVMs solved.
  [[nodiscard]] std::size_t fits() const { return fits_; }

 private:
  struct Remembered {
    GridScore score;
    bool known = false;
  };
  void measure();
  Status use_kernel(std::size_t slot, std::size_t gamma);
  [[nodiscard]] GridScore validate() const;
  [[nodiscard]] std::size_t number_of(std::size_t gamma, std::size_t c, std::size_t slot) const {
    return (slot * options_->grid.gamma.size() + gamma) * options_->grid.c.size() + c;
  }

  const TrainOptions* options_ = nullptr;
  std::vector<std::size_t>
      train_;  // row numbers, those with sign -1 first: the order of the solver
  std::vector<int> train_sign_;
  Matrix projected_;                  // [(train + validate) x directions]
  std::vector<std::size_t> sizes_;    // per member
  std::vector<std::size_t> slot_of_;  // per member: index of its distances
  std::vector<Matrix> distances_;     // [(train + validate) x train] per distinct size
  std::size_t slots_ = 0;             // number of distances_ in use
  std::vector<LossBound> bounds_;     // per entry of distances_
  std::vector<int> sign_;             // of the held-out rows
  SvmSolver solver_;
  Matrix kernel_;  // [(train + validate) x train] of the current problem of the solver
  std::size_t held_slot_ = 0, held_gamma_ = 0;
  bool holds_kernel_ = false;
  std::vector<Remembered> scores_;
  std::size_t fits_ = 0;
};

/// The chosen point. `member` indexes the deltas (or explained shares).
struct GridResult {
  std::vector<GridScore> scores;  ///< [members x gammas x Cs]; none with Search::fast
  std::size_t member = 0;
  std::size_t gamma = 0;
  std::size_t c = 0;
  GridScore best;
  std::size_t fits = 0;  ///< number of SVMs solved; shared problems count once
};

/// Searches the grid of one core. One object per thread; it keeps its memory from core to core.
class GridSearch {
 public:
  /// `full` is the reducer fitted to all `rows`; with options.nested every fold fits its own.
  /// Refuses folds with a row out of range, with a class without a training row, or, where p-values
  /// are nested, with fewer than three training rows.
  Result<GridResult> run(const Matrix& rows, std::span<const int> sign, const Reducer& full,
                         std::span<const Fold> folds, const TrainOptions& options,
                         const RareT& rare = RareT());

 private:
  std::vector<FoldProblem> problems_;
};

}  // namespace weft::classifier
