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

// In what the folds of a training are not those that were asked for, for people and programs.

struct FoldReport {
  /// No folds: the learner was not tested, so neither chosen, tuned nor calibrated by what it does
  /// with rows held out.
  bool none = false;
  std::map<std::string, std::string> finer;     ///< label: "recording" or "window"
  std::map<std::string, std::size_t> untested;  ///< label: its rows, of which none is held out
  bool windows = false;                         ///< rows are windows of recordings
  std::size_t folds = 0;                        ///< as asked for

  /// Nothing to report.
  [[nodiscard]] bool as_requested() const { return !none && finer.empty() && untested.empty(); }
};

/// Of cores the folds of their pairs; of a choice and of everything else class_folds().
FoldReport fold_report(const FeatureMatrix& matrix, Learner learner, const TrainOptions& options);

/// "c dealt by recording, not tested: zz (2 trials)"; of no folds "none: label zz has 2 trials, too
/// few for 5 folds that train on 2 of each".
/// Empty where the folds are those asked for.
std::string format_folds(const FoldReport& report);

/// Folds, and by which units each class was dealt into them.
struct ClassFolds {
  std::vector<Fold> folds;         ///< empty: nothing can be tested
  std::vector<std::size_t> level;  ///< per class: of the levels; their number: it is never held out

  /// Whether rows of the class are held out, where there are folds.
  [[nodiscard]] bool tests(std::size_t own, const UnitLevels& levels) const {
    return level[own] < levels.size();
  }
};

/// Stratified folds: units stay together, and every fold trains on at least two rows of every class
/// (as a core needs). At most `folds`; fewer where a class has fewer units. Every row validates
/// once, by units of levels[0], where these can be dealt so. Where they cannot, classes of which
/// they are too few are dealt by the next finer level, all others stay; a class with too few rows
/// (two) is never held out. No folds where fewer than two classes could be: errors of one class
/// alone say nothing. Reproducible from the seed. Every class has two rows, `levels` one level.
ClassFolds class_folds(std::span<const std::size_t> of_row, const UnitLevels& levels,
                       std::size_t folds, std::uint64_t seed);

/// The same of unit_levels() and with the options of a training.
ClassFolds class_folds(const FeatureMatrix& matrix, const TrainOptions& options);

}  // namespace weft::classifier
