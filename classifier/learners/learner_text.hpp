#pragma once
// A trained learner as lines of a stored model, bit for bit; a training task as lines.

#include <string>
#include <string_view>
#include <vector>

#include "classifier/base/line_io.hpp"
#include "classifier/learners/learner.hpp"

namespace weft::classifier {

/// What precedes labels and features: which learner it is.
struct LearnerHead {
  Learner kind = Learner::pvalue;
  View view = View::plain;
};
void write_head(LineWriter& out, const LearnerHead& head);
/// Of a file of fabrics of this version: 5 knows no trees, 4 no ranks either, 3 plain cores only.
LearnerHead read_head(LineReader& in, int version = 6);

/// The lines of cores.
void write_cores(LineWriter& out, const std::vector<FabricCore>& cores);

/// All but the head, labels and features.
void write_learner(LineWriter& out, const TrainedLearner& learner);

/// `labels` at least two, `features` at least one. `in` keeps the first problem; empty then.
std::optional<TrainedLearner> read_learner(LineReader& in, const LearnerHead& head,
                                           std::vector<std::string> labels,
                                           std::vector<std::string> features);

/// For trainings that several processes share.
std::string task_text(const CoreTask& task);
/// What task_text() wrote. Errors: corrupt.
Result<CoreTask> task_from_text(std::string_view text);

}  // namespace weft::classifier
