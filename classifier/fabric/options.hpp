#pragma once
// Settings of the training of all fabric classification cores.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::classifier {

enum class Reduction {
  pvalue,  ///< features with p < delta, the paper's method
  pca,     ///< principal components of the scaled features, the paper's comparison (AMB-20)
  all      ///< no reduction
};

std::string_view to_string(Reduction reduction);
Result<Reduction> reduction_from(std::string_view text);

/// Which two-sample test finds the features that tell two fabrics apart.
enum class TTest {
  pooled,  ///< Student's, one variance for both fabrics: the paper's
  welch    ///< a variance for each
};

/// What decides between grid points with equally few cross-validation errors (AMB-16).
enum class Tie {
  automatic,  ///< `loss`; `order` where there are many_fabrics or more
  loss,       ///< the smaller validation hinge loss, to 1e-9; then as `order`
  order       ///< the smaller C, then gamma, then delta (or fewer components)
};

/// From so many fabrics on Tie::automatic is Tie::order: deciding by loss takes three times the
/// fits, which grow with the square of the number of fabrics, and no difference in accuracy was
/// measured.
inline constexpr std::size_t many_fabrics = 100;

/// What `tie` means for a training on so many fabrics: loss or order.
constexpr Tie resolved(Tie tie, std::size_t fabrics) {
  if (tie != Tie::automatic) return tie;
  return fabrics < many_fabrics ? Tie::loss : Tie::order;
}

std::string_view to_string(Tie tie);

/// Who solves the SVMs and how the grid is walked. All three choose the same parameters and train
/// the same model.
enum class Search {
  fast,   ///< own dense solver; what cannot win any more is skipped
  whole,  ///< own dense solver; every grid point is scored
  libsvm  ///< libsvm, the reference; every grid point is solved by itself and scored
};

/// What stays together in a fold of the cross-validation.
enum class FoldUnit {
  recording,  ///< a file; windows cut from one file (recording_of()) are one recording
  group       ///< all trials of a group: parameters must survive a change of session
};

/// The grid of AMB-19. `delta` belongs to Reduction::pvalue, `explained` to Reduction::pca.
struct Grid {
  /// Where a kernel is flat, a multiplier grows by about 1e12 a step (1 / libsvm's least
  /// curvature): a larger C would take for ever and change nothing.
  static constexpr double most_c = 1e12;

  std::vector<double> c = {0.5, 2, 8, 32, 128, 512, 2048};
  std::vector<double> gamma = {0x1p-11, 0x1p-9, 0x1p-7, 0x1p-5, 0x1p-3, 0x1p-1, 0x1p1};
  std::vector<double> delta = {1e-5, 1e-4, 1e-3, 1e-2, 5e-2};
  std::vector<double> explained = {0.80, 0.90, 0.95, 0.99, 0.999};
};

/// A fold of a cross-validation. Row numbers, ascending.
struct Fold {
  std::vector<std::size_t> train;
  std::vector<std::size_t> validate;
};

/// Fewest rows to select features from: the pooled t-test has n - 2 degrees of freedom.
inline constexpr std::size_t least_fold_rows = 3;

/// The folds of one core from the signs of its training rows (class a +1, class b -1).
using FoldMaker = std::function<std::vector<Fold>(std::span<const int> sign)>;

struct TrainOptions {
  Reduction reduction = Reduction::pvalue;
  TTest t_test = TTest::pooled;  ///< of Reduction::pvalue
  /// Select again inside each fold; false: once from all training rows (AMB-15).
  bool nested = true;
  Tie tie = Tie::automatic;
  Search search = Search::fast;
  Grid grid = {};
  std::size_t cap = 20;   ///< the paper's N: most features (or components) of a core
  std::size_t folds = 5;  ///< fewer when a class has fewer trials
  FoldUnit fold_unit = FoldUnit::recording;
  double tolerance = 1e-3;   ///< libsvm's stopping tolerance
  std::uint64_t seed = 1;    ///< of the folds, and of trees
  std::size_t trees = 1000;  ///< of forests; as many as that of the paper of 2023 has
  std::size_t threads = 0;   ///< 0: one per core; the model does not depend on it
  /// train_recipe(): rows that have a value further than so many standard deviations from the mean
  /// do not train (S10 in docs/reference/machine-learning.md); 0: all do.
  double outliers = 0.0;
  /// train_best(): most that the test of all candidates may cost, by a formula of their shapes
  /// (training_cost()) and by no clock. 0 or infinite: whatever it costs. [s of the reference
  /// machine]
  double budget = 60.0;
  FoldMaker make_folds = {};  ///< empty: stratified_folds() of units_by_label()
  /// Counts the problems that no solver brought to the tolerance; empty: nobody asks. Shared by all
  /// threads.
  std::shared_ptr<std::atomic<std::size_t>> unconverged = {};
  /// True: give up. Asked often, on every thread that trains; empty: never.
  std::function<bool()> stop = {};
};

/// To options.unconverged.
void note_unconverged(const TrainOptions& options);

/// Errors: wrong_state, when `stop`, which may be empty, says that the training is to be given up.
Status unless_stopped(const std::function<bool()>& stop);

/// Refuses empty or unusable grids, cap 0, folds < 2.
Status check(const TrainOptions& options);

}  // namespace weft::classifier
