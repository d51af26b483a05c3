#pragma once
// The hand-over of one exploration. From taxels: features, groups of repetitions, evaluation,
// model. From vibration: windows of sound and acceleration, groups of repetitions left out, the
// learner chosen on what trains; with "every" the ten learners of the 2023 paper under its own
// protocol and under this one; evaluated only, no model is kept. From imprints: Ellis' experiments
// and a model.

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/evaluate/splits.hpp"
#include "classifier/learners/class_folds.hpp"
#include "classifier/model/stored_model.hpp"
#include "classifier/vibro/cross_validation.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "daemon/analysis/handover/handover.hpp"
#include "daemon/analysis/tradeoff/measure_vibro.hpp"
#include "daemon/storage/certificate/handover_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/recordings/recording_set.hpp"

namespace weft::daemon {

/// How evaluation.json begins: bench, campaign, digests and version.
nlohmann::ordered_json handover_heading_json(const DatasetInfo& info,
                                             const std::string& dataset_sha256);
/// The line of evaluation.json about a model in a file: of so many trials, with the accuracy of
/// others like it.
nlohmann::ordered_json model_line_json(const std::string& name, const HandoverText& model,
                                       const std::string& learner, std::size_t trials,
                                       const classifier::Evaluation& evaluation);

// The hand-over of a campaign of presses: the experiments of Ellis 1986 on its imprints, and a
// model of them all.

/// What evaluation.json says; adds imprints.html, imprints.json and imprints.model to `texts`.
/// The tables of daemon/storage/imprints on the complete trials of `data`, with all scales, forms
/// and rules; a model with `weft imprint train`'s defaults, and its accuracy by leaving each object
/// out in turn. Errors: a data set without imprints, what the rules and the learners refuse,
/// wrong_state where it is stopped.
Result<nlohmann::ordered_json> run_imprint_handover(
    const Dataset& data, const std::string& dataset_sha256, const recipes::Handover& wanted,
    const HandoverHooks& hooks, const StopRequested& stop, std::vector<HandoverText>& texts);

/// The complete trials of one exploration, and the repetition of each.
struct LearningMaterial {
  std::string exploration;
  std::vector<classifier::Trial> trials;
  std::vector<std::uint32_t> repetition;  ///< from 1, index by index
};

struct TrainingResult {
  LearningMaterial material;
  classifier::StoredModel model;  ///< of all trials
  std::string learner;            ///< in words
  classifier::Evaluation evaluation;
  std::vector<classifier::Split> splits;
  std::size_t features = 0;
  double train_s = 0;  ///< of the model, measured
};
/// `options` with the stop in it. Errors: the classifier's.
Result<TrainingResult> train_exploration(const Dataset& dataset, const std::string& exploration,
                                         const std::string& dataset_sha256,
                                         const recipes::Handover& wanted, std::uint32_t repetitions,
                                         const classifier::TrainOptions& options,
                                         const HandoverHooks& hooks,
                                         const std::function<void(const std::string&)>& announce);

/// What evaluation.json says of it.
nlohmann::ordered_json training_json(const TrainingResult& training_result);
/// The page of the same.
Document training_document(const DatasetInfo& info, const recipes::Handover& wanted,
                           const TrainingResult& training_result);

/// Phase M of the complete trials of one exploration, the group of each the one that its repetition
/// is dealt into (`group_of` repetition i + 1, see recipes::repetition_groups()), "1" for the
/// first. Errors: extract_recordings()'s.
Result<RecordingSet> vibration_material(const Dataset& dataset, const std::string& exploration,
                                        const std::vector<std::size_t>& group_of);

/// What a learner reaches on groups of repetitions that it, and its choice, never saw.
struct ChosenLearner {
  double window_s = 0, step_s = 0;
  std::size_t windows = 0, columns = 0, groups = 0;
  classifier::vibro::CrossValidation result;  ///< its `chosen`: of each group left out
};

struct VibrationTrainingResult {
  ChosenLearner best;
  VibroTradeoff tradeoff;  ///< of "every"; else without points
  std::vector<std::string> materials;
};

/// `announce` is told before each of vibration_steps(wanted). `stop` is asked before each training.
/// Errors: recordings too short for a window of 2 s, the classifier's.
Result<VibrationTrainingResult> train_vibration(
    const RecordingSet& set, const recipes::Handover& wanted, const HandoverHooks& hooks,
    const StopRequested& stop, const std::function<void(const std::string&)>& announce);
std::size_t vibration_steps(const recipes::Handover& wanted);

/// What is told of it in a line. `file`: its page.
HandoverEvaluation make_evaluation(const std::string& exploration, const std::string& file,
                                   const RecordingSet& set,
                                   const VibrationTrainingResult& training_result);
/// What evaluation.json says of it.
nlohmann::ordered_json vibration_json(const RecordingSet& set,
                                      const VibrationTrainingResult& training_result);
/// The page of the same: accuracy, confusion by material, macro F-score against time, the paper's
/// tables.
Result<Document> vibration_document(const std::string& exploration, const RecordingSet& set,
                                    const VibrationTrainingResult& training_result);

/// NAME.html and NAME.json, the record that it is drawn from. Errors: page_of_record()'s.
Status add_page(const std::string& name, const nlohmann::ordered_json& record,
                const Document& document, std::vector<HandoverText>& texts);

}  // namespace weft::daemon
