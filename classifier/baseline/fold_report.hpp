#pragma once
// In what the folds of a training are not those that were asked for, for people and programs.

#include <cstddef>
#include <map>
#include <string>

#include "classifier/baseline/learner.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/features/feature_matrix.hpp"

namespace weft::classifier {

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

}  // namespace weft::classifier
