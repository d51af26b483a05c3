#pragma once
// A trained learner as lines of a stored model, bit for bit; a training task as lines.

#include <string>
#include <string_view>
#include <vector>

#include "classifier/base/line_io.hpp"
#include "classifier/learners/learner.hpp"

namespace weft::classifier {

/// Lines before labels and features: the kind of learner.
struct LearnerHead {
  Learner kind = Learner::pvalue;
  View view = View::plain;
};
void write_head(LineWriter& out, const LearnerHead& head);
/// Reads the head of a fabric file of this version: 5 has no trees, 4 also no ranks, 3 only plain
/// cores.
LearnerHead read_head(LineReader& in, int version = 6);

/// Writes the lines of cores.
void write_cores(LineWriter& out, const std::vector<FabricCore>& cores);

/// Writes everything except the head, labels and features.
void write_learner(LineWriter& out, const TrainedLearner& learner);

/// Needs at least two `labels` and one of `features`. Problems are recorded in `in`; the result is
/// then empty.
std::optional<TrainedLearner> read_learner(LineReader& in, const LearnerHead& head,
                                           std::vector<std::string> labels,
                                           std::vector<std::string> features);

/// Text of a task, for trainings that several processes share.
std::string task_text(const CoreTask& task);
/// Reads the text of task_text(). Errors: corrupt.
Result<CoreTask> task_from_text(std::string_view text);

}  // namespace weft::classifier
