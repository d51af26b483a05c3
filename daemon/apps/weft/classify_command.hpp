#pragma once
// What `weft fabric classify` says of one trial.

#include <string>

#include "classifier/vote/postprocessing.hpp"

namespace weft::daemon::cli {

/// A trial and the answer on it.
struct PredictedTrial {
  std::string file;
  std::string true_label;         ///< empty: not known
  classifier::Prediction answer;  ///< without probability and refusal where the model has no aids
};

/// "trial.csv: denim 97 %, or none of these  (votes: denim 3 silk 2)" and a line break; the ten
/// fabrics with most votes are named.
std::string answer_line(const classifier::TrainedLearner& learner, const PredictedTrial& answered);

}  // namespace weft::daemon::cli
