#pragma once
// Text of `weft fabric classify` for one trial.

#include <string>

#include "classifier/vote/postprocessing.hpp"

namespace weft::daemon::cli {

/// A trial and its prediction.
struct PredictedTrial {
  std::string file;
  std::string true_label;         ///< empty: not known
  classifier::Prediction answer;  ///< without probability and refusal if the model has no aids
};

/// "trial.csv: denim 97 %, or none of these  (votes: denim 3 silk 2)" and a line break. It names
/// the ten fabrics with most votes.
std::string answer_line(const classifier::TrainedLearner& learner, const PredictedTrial& answered);

}  // namespace weft::daemon::cli
