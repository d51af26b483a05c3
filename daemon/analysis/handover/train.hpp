#pragma once
// One exploration of a hand-over: features, groups of repetitions, evaluation, model.

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "classifier/baseline/class_folds.hpp"
#include "classifier/evaluate/splits.hpp"
#include "classifier/model/model_file.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "daemon/analysis/handover/handover.hpp"
#include "daemon/storage/certificate/handover_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

// The hand-over of a campaign of presses: the experiments of Ellis 1986 on its imprints, and a
// model of them all.

struct HandoverImprints {
  std::string evaluation_json;      ///< what evaluation.json says
  std::vector<HandoverText> texts;  ///< imprints.html, imprints.json, imprints.model
};

/// The tables of daemon/storage/imprints on the complete trials of `data`, with all scales, forms
/// and rules; a model with `weft train`'s defaults, and its accuracy by leaving each object out in
/// turn. Errors: a data set without imprints, what the rules and the learners refuse, wrong_state
/// where it is stopped.
Result<HandoverImprints> run_imprint_handover(const Dataset& data,
                                              const std::string& dataset_sha256,
                                              const recipes::Handover& wanted,
                                              const HandoverHooks& hooks,
                                              std::function<bool()> stop);

/// The complete trials of one exploration, and the repetition of each.
struct LearningMaterial {
  std::string exploration;
  std::vector<classifier::Trial> trials;
  std::vector<std::uint32_t> repetition;  ///< from 1, index by index
};
LearningMaterial collect_material(const Dataset& dataset, const std::string& exploration);

/// Each group of repetitions tests once, all others train; a group without trials tests nothing.
/// `group_of`: of repetition i + 1, see recipes::repetition_groups().
std::vector<classifier::Split> splits_by_repetition(const std::vector<std::uint32_t>& repetition,
                                                    const std::vector<std::size_t>& group_of);

/// A learner of all rows of a matrix, and what others like it reached that lacked some of them.
struct EvaluatedModel {
  classifier::LearnerEvaluation evaluation;
  classifier::TrainedLearner learner;
  std::optional<classifier::VotePostprocessing>
      postprocessing;  ///< nothing where no fold could be made
  classifier::FoldReport folds;
  std::string words;   ///< which learner it is: "lda, ranks"
  double train_s = 0;  ///< of the model, measured
};
/// What to learn from, and what each split leaves out, in words.
struct TrainingTask {
  std::string name;
  classifier::FeatureMatrix matrix;
  std::vector<classifier::Split> splits;
  std::string left_out;
};
/// `announce` is told of both parts: "M1: 5 trainings, each without one group of repetitions".
/// Errors: the classifier's.
Result<EvaluatedModel> evaluate_and_train(const TrainingTask& task, classifier::Learner learner,
                                          const classifier::TrainOptions& options,
                                          const HandoverHooks& hooks,
                                          const std::function<void(const std::string&)>& announce);

/// How it was trained, for the model's provenance.
std::string format_training(std::string_view learner, const classifier::TrainOptions& options,
                            std::size_t labels, const classifier::FoldReport& folds);

/// What an evaluation says, for evaluation.json: evaluation_json() with the share of all answers
/// and the calibration.
nlohmann::ordered_json evaluated_json(const classifier::LearnerEvaluation& evaluation);

struct TrainingResult {
  classifier::StoredModel model;  ///< of all trials
  std::string learner;            ///< in words
  classifier::LearnerEvaluation evaluation;
  std::vector<classifier::Split> splits;
  std::size_t features = 0;
  double train_s = 0;  ///< of the model, measured
};
/// `options` with the stop in it. Errors: the classifier's.
Result<TrainingResult> train_exploration(const LearningMaterial& material, const DatasetInfo& info,
                                         const std::string& dataset_sha256,
                                         const recipes::Handover& wanted, std::uint32_t repetitions,
                                         const classifier::TrainOptions& options,
                                         const HandoverHooks& hooks,
                                         const std::function<void(const std::string&)>& announce);

/// What evaluation.json says of it.
nlohmann::ordered_json training_json(const LearningMaterial& material,
                                     const TrainingResult& training_result);
/// The page of the same.
std::string training_html(const LearningMaterial& material, const DatasetInfo& info,
                          const recipes::Handover& wanted, const TrainingResult& training_result);

}  // namespace weft::daemon
