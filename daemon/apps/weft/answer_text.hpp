#pragma once
// What a model of fabrics or of imprints said of one trial, for people and for programs.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "classifier/fabric/model_text.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::daemon::cli {

/// What is not as after a good end, and what to do; empty where the probe is up and nothing was
/// left out.
std::string format_rig(recipes::Cleanup cleanup, recipes::RigFact rig);

/// A line that says so where the model learnt from simulated data; nothing otherwise.
std::string trained_banner(const classifier::Provenance& provenance);

/// A trial and the answer on it.
struct PredictedTrial {
  std::string file;
  std::string true_label;         ///< empty: not known
  classifier::Prediction answer;  ///< without probability and refusal where the model has no aids
};

/// [{file, label, votes, cores_asked, probability, none_of_these, true_label}], what there is of
/// it.
nlohmann::json answers_json(const classifier::TrainedLearner& learner, bool has_postprocessing,
                            const std::vector<PredictedTrial>& answered);

/// "trial.csv: denim 97 %, or none of these  (votes: denim 3 silk 2)" and a line break; the ten
/// fabrics with most votes are named.
std::string answer_line(const classifier::TrainedLearner& learner, const PredictedTrial& answered);

}  // namespace weft::daemon::cli
