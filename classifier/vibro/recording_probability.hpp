#pragma once
// How likely each label is for a whole recording, from the answers on its windows.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "classifier/learners/learner.hpp"
#include "classifier/vibro/extract.hpp"
#include "classifier/vote/postprocessing.hpp"

namespace weft::classifier::vibro {

/// From windows per label, at least one in all: their share, with one window more that is of every
/// label alike, to the power `sharpness`. Positive, sum 1; the more windows, the likelier, so the
/// most frequent label is the likeliest. Mean and product of the windows' own probabilities are
/// worse calibrated (classifier/vibro/README.md).
std::vector<double> share_of_windows(std::span<const std::size_t> windows, double sharpness = 1.0);

/// Why recordings of such a training get no probability: fewer than two labels have as many
/// recordings as can be held out. Empty where they get one. `windows` need no features.
std::string reason_without_probability(const FeatureMatrix& windows, Learner learner,
                                       const TrainOptions& options);

/// The sharpness of share_of_windows() under which the true labels of held-out recordings are most
/// likely, of labels of which whole recordings were held out (folds of the training). No profile
/// and no reject rule. Nothing where reason_without_probability() has one. Refuses what
/// predict_held_out() refuses.
Result<std::optional<VotePostprocessing>> calibrate_recordings(const TrainedLearner& learner,
                                                               const WindowSet& windows,
                                                               const TrainOptions& options);

}  // namespace weft::classifier::vibro
