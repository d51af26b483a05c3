#pragma once
// What was learnt, whatever the features are of, as lines of a stored model: learner, labels, names
// of the features, vote aids.

#include <optional>
#include <string>
#include <vector>

#include "classifier/baseline/learner_text.hpp"
#include "classifier/vote/postprocessing.hpp"

namespace weft::classifier {

struct ModelParts {
  TrainedLearner learner;
  std::optional<VotePostprocessing> postprocessing;
};

void write_model_parts(LineWriter& out, const TrainedLearner& learner,
                       const std::optional<VotePostprocessing>& postprocessing);

/// What follows head and labels, bit for bit. Refuses features of other names than `expected`.
/// `in` keeps the first problem; nothing then.
std::optional<ModelParts> read_model_parts(LineReader& in, const LearnerHead& head,
                                           std::vector<std::string> labels,
                                           const std::vector<std::string>& expected);

}  // namespace weft::classifier
