#pragma once
// Folds of a cross-validation of more than two classes.

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "classifier/fabric/folds.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learners/learner.hpp"

namespace weft::classifier {

// How the folds of a training differ from the requested ones.

struct FoldReport {
  /// No folds: the learner was not tested on held-out rows, so no choice, tuning or calibration
  /// used them.
  bool none = false;
  std::map<std::string, std::string> finer;  ///< label -> finer unit: "recording" or "window"
  std::map<std::string, std::size_t>
      untested;           ///< label -> number of its rows; none of them is held out
  bool windows = false;   ///< rows are windows of recordings
  std::size_t folds = 0;  ///< as requested

  /// True if there is nothing to report.
  [[nodiscard]] bool as_requested() const { return !none && finer.empty() && untested.empty(); }
};

/// For cores it reports the folds of their pairs, for choices and all other learners class_folds().
FoldReport fold_report(const FeatureMatrix& matrix, Learner learner, const TrainOptions& options);

/// "c dealt by recording, not tested: zz (2 trials)"; without folds "none: label zz has 2 trials,
/// too few for 5 folds that train on 2 of each". Empty if the folds are as requested.
std::string format_folds(const FoldReport& report);

/// Folds, and the level of the units by which each class was dealt.
struct ClassFolds {
  std::vector<Fold> folds;  ///< empty: nothing can be tested
  std::vector<std::size_t>
      level;  ///< per class: index of its level; the number of levels if it is never held out

  /// True if rows of the class are held out, provided there are folds.
  [[nodiscard]] bool tests(std::size_t own, const UnitLevels& levels) const {
    return level[own] < levels.size();
  }
};

/// Stratified folds. Units stay together, and every fold trains on at least two rows of every class
/// (as a core needs). At most `folds`; fewer if a class has fewer units. Every row validates once,
/// by units of levels[0] where possible. A class with too few of these is dealt by the next finer
/// level; all others stay. A class with too few rows (two) is never held out. There are no folds if
/// fewer than two classes could be held out, as the errors of one class alone mean nothing.
/// Reproducible from the seed. Every class needs two rows, `levels` one level.
ClassFolds class_folds(std::span<const std::size_t> of_row, const UnitLevels& levels,
                       std::size_t folds, std::uint64_t seed);

/// The same with unit_levels() and the options of a training.
ClassFolds class_folds(const FeatureMatrix& matrix, const TrainOptions& options);

}  // namespace weft::classifier
