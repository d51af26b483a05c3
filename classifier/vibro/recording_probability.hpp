#pragma once
// Probability of each label for a whole recording, from the predictions of its windows.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "classifier/learners/learner.hpp"
#include "classifier/vibro/extract.hpp"
#include "classifier/vote/postprocessing.hpp"

namespace weft::classifier::vibro {

/// Share of the windows per label, to the power `sharpness`; at least one window in all. One more
/// window is added, divided equally among the labels. Positive, sum 1. More windows give a larger
/// probability, so the most frequent label is the likeliest. Mean and product of the windows' own
/// probabilities are worse calibrated (classifier/MEASURED.md).
std::vector<double> share_of_windows(std::span<const std::size_t> windows, double sharpness = 1.0);

/// Reason why such recordings get no probability: fewer than two labels have enough recordings to
/// hold one out. Empty if they get one. `windows` need no features.
std::string reason_without_probability(const FeatureMatrix& windows, Learner learner,
                                       const TrainOptions& options);

/// Fits the sharpness of share_of_windows() with the largest likelihood of the true labels of
/// held-out recordings. Only labels with whole recordings held out count (folds of the training).
/// There is no profile and no reject rule. Empty if reason_without_probability() gives a reason.
/// Refuses what predict_held_out() refuses.
Result<std::optional<VotePostprocessing>> calibrate_recordings(const TrainedLearner& learner,
                                                               const WindowSet& windows,
                                                               const TrainOptions& options);

}  // namespace weft::classifier::vibro
