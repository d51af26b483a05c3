#pragma once
// Open-set check of any learner: each fabric is left out of a training and then tested as unknown.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/evaluate/splits.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learners/learner.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Test trials of one fabric, predicted by learners that were not trained on it.
struct UnknownLabel {
  std::string label;
  std::size_t trials = 0;    ///< distinct trials
  std::size_t answers = 0;   ///< over all splits; a trial counts in each split that tests it
  std::size_t accepted = 0;  ///< answers that named one of the trained fabrics
};

struct OpenSetCheck {
  std::vector<UnknownLabel> unknown_labels;  ///< one per label, sorted by label; over all splits
  double false_accept = 0.0;                 ///< accepted / answers, over all unknown labels
  /// Labels that could not be left out in some split: too few trials remain to learn thresholds.
  std::vector<std::string> not_measured;
  Interval false_accept_ci95;  ///< split_interval() of the splits' answers
  double false_reject =
      0.0;  ///< refused trials of trained fabrics / their number, over all trainings
};

/// Refuses fewer than three labels in a training part, as check_open_set() does. Call it before any
/// training.
Status check_labels_can_be_left_out(const FeatureMatrix& matrix, std::span<const Split> splits);

/// For every label: trains recipes[s] on each split's training part without that label, thresholds
/// included, and predicts the test part. This calls train_recipe() and fit_postprocessing() labels
/// x splits times. The choice of the recipe may have used the label. Refuses what these functions
/// refuse, fewer than three labels in a training part, no split, and data where no label could be
/// left out.
Result<OpenSetCheck> check_open_set(const FeatureMatrix& matrix, std::span<const Split> splits,
                                    std::span<const Recipe> recipes, const TrainOptions& options);

}  // namespace weft::classifier
