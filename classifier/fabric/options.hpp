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
  pvalue,  ///< features with p < delta; the paper's method
  pca,     ///< principal components of the scaled features; the paper's comparison (AMB-20)
  all      ///< no reduction
};

std::string_view to_string(Reduction reduction);
Result<Reduction> reduction_from(std::string_view text);

/// The two-sample test that selects the features which separate two fabrics.
enum class TTest {
  pooled,  ///< Student's, one variance for both fabrics; the paper's test
  welch    ///< a variance for each fabric
};

/// Decides between grid points with equally few cross-validation errors (AMB-16).
enum class Tie {
  automatic,  ///< `loss`; `order` with many_fabrics or more
  loss,       ///< the smaller validation hinge loss, to 1e-9; then as `order`
  order       ///< the smaller C, then gamma, then delta (or fewer components)
};

/// Number of fabrics from which Tie::automatic is Tie::order. Deciding by loss takes three times
/// the fits, and the fits grow with the square of the number of fabrics. No difference in accuracy
/// was measured.
inline constexpr std::size_t many_fabrics = 100;

/// Resolves `tie` for training on this number of fabrics: loss or order.
constexpr Tie resolved(Tie tie, std::size_t fabrics) {
  if (tie != Tie::automatic) return tie;
  return fabrics < many_fabrics ? Tie::loss : Tie::order;
}

std::string_view to_string(Tie tie);

/// The SVM solver and the walk through the grid. All three choose the same parameters and train the
/// same model.
enum class Search {
  fast,   ///< own dense solver; skips points that cannot win
  whole,  ///< own dense solver; scores every grid point
  libsvm  ///< libsvm, the reference; solves every grid point separately and scores it
};

/// Unit that stays together in a fold of the cross-validation.
enum class FoldUnit {
  recording,  ///< a file; windows cut from one file (recording_of()) are one recording
  group       ///< all trials of a group: tests whether the parameters survive a change of session
};

/// The grid of AMB-19. `delta` belongs to Reduction::pvalue, `explained` to Reduction::pca.
struct Grid {
  /// Largest C. In a flat kernel a multiplier grows by about 1e12 a step (1 / libsvm's least
  /// curvature). A larger C would take very long and change nothing.
  static constexpr double most_c = 1e12;

  std::vector<double> c = {0.5, 2, 8, 32, 128, 512, 2048};
  std::vector<double> gamma = {0x1p-11, 0x1p-9, 0x1p-7, 0x1p-5, 0x1p-3, 0x1p-1, 0x1p1};
  std::vector<double> delta = {1e-5, 1e-4, 1e-3, 1e-2, 5e-2};
  std::vector<double> explained = {0.80, 0.90, 0.95, 0.99, 0.999};
};

/// A fold of a cross-validation; row numbers, ascending.
struct Fold {
  std::vector<std::size_t> train;
  std::vector<std::size_t> validate;
};

/// Fewest rows for the selection of features: the pooled t-test has n - 2 degrees of freedom.
inline constexpr std::size_t least_fold_rows = 3;

/// The folds of one core from the signs of its training rows (class a +1, class b -1).
using FoldMaker = std::function<std::vector<Fold>(std::span<const int> sign)>;

struct TrainOptions {
  Reduction reduction = Reduction::pvalue;
  TTest t_test = TTest::pooled;  ///< with Reduction::pvalue
  /// True: select again inside each fold; false: select once from all training rows (AMB-15).
  bool nested = true;
  Tie tie = Tie::automatic;
  Search search = Search::fast;
  Grid grid = {};
  std::size_t cap = 20;   ///< the paper's N: most features (or components) of a core
  std::size_t folds = 5;  ///< fewer if a class has fewer trials
  FoldUnit fold_unit = FoldUnit::recording;
  double tolerance = 1e-3;   ///< libsvm's stopping tolerance
  std::uint64_t seed = 1;    ///< for the folds and for trees
  std::size_t trees = 1000;  ///< trees of a forest; the paper of 2023 has the same number
  std::size_t threads = 0;   ///< 0: one per core; the model does not depend on it
  /// train_recipe(): rows with a value further than this number of standard deviations from the
  /// mean do not train (S10 in docs/reference/machine-learning.md). 0: all rows train.
  double outliers = 0.0;
  /// train_best(): upper limit of the cost of testing all candidates. The cost comes from a formula
  /// of their shapes (training_cost()), not from a clock. 0 or infinite: no limit. [s of the
  /// reference machine]
  double budget = 60.0;
  FoldMaker make_folds = {};  ///< empty: stratified_folds() of units_by_label()
  /// Counts the problems that no solver brought to the tolerance; empty: no count. Shared by all
  /// threads.
  std::shared_ptr<std::atomic<std::size_t>> unconverged = {};
  /// Returns true to cancel the training. Called often, on every training thread; empty: never
  /// cancel.
  std::function<bool()> stop = {};
};

/// Adds one to options.unconverged.
void note_unconverged(const TrainOptions& options);

/// Errors: wrong_state if `stop` (may be empty) requests to cancel the training.
Status unless_stopped(const std::function<bool()>& stop);

/// Refuses empty or unusable grids, cap 0, folds < 2.
Status check(const TrainOptions& options);

}  // namespace weft::classifier
