#pragma once
// A trained learner as lines of a stored model, bit for bit.

#include <cstddef>
#include <string>
#include <vector>

#include "classifier/baseline/learner.hpp"
#include "classifier/fabric/line_text.hpp"

namespace weft::classifier {

/// What precedes labels and features: which learner it is.
struct LearnerHead {
  Learner kind = Learner::pvalue;
  bool compressed = false;
};
void write_head(LineWriter& out, const LearnerHead& head);
LearnerHead read_head(LineReader& in);
/// Of a file of version 3, which knows cores only: one line.
LearnerHead read_head_of_version_3(LineReader& in);

/// All but the head, labels and features.
void write_learner(LineWriter& out, const TrainedLearner& learner);

/// `labels` at least two, `features` at least one. `in` keeps the first problem; empty then.
std::optional<TrainedLearner> read_learner(LineReader& in, const LearnerHead& head,
                                           std::vector<std::string> labels,
                                           std::vector<std::string> features);

}  // namespace weft::classifier
