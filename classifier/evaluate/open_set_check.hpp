#pragma once
// "None of these" of any learner: every fabric in turn is left out of the training and shown to it.

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

/// Test trials of one fabric, shown to learners that never met it.
struct UnknownLabel {
  std::string label;
  std::size_t trials = 0;    ///< different ones
  std::size_t answers = 0;   ///< over all splits: a trial is asked in each that tests it
  std::size_t accepted = 0;  ///< of the answers: taken for one of the others
};

struct OpenSetCheck {
  std::vector<UnknownLabel> unknown_labels;  ///< one per label, sorted; over all splits
  double false_accept = 0.0;                 ///< accepted / answers, over all strangers
  /// Labels without which, in some split, too little is left to learn thresholds from.
  std::vector<std::string> not_measured;
  Interval false_accept_ci95;  ///< split_interval() of the splits' answers
  double false_reject = 0.0;   ///< refused known trials / known trials, over all trainings
};

/// Refuses fewer than three labels in a training part: what check_open_set() would refuse, known
/// before anything is trained.
Status check_labels_can_be_left_out(const FeatureMatrix& matrix, std::span<const Split> splits);

/// Trains recipes[s] on each split's training part without one label, thresholds included, and
/// shows it the test part; so for every label. Asks train_recipe() and fit_postprocessing() labels
/// x splits times. The recipe itself may have been chosen with the label. Refuses what these
/// refuse, fewer than three labels in a training part, no split, and where no label could be left
/// out.
Result<OpenSetCheck> check_open_set(const FeatureMatrix& matrix, std::span<const Split> splits,
                                    std::span<const Recipe> recipes, const TrainOptions& options);

}  // namespace weft::classifier
