#pragma once
// The handover of one exploration. Taxels: features, groups of repetitions, evaluation, model.
// Vibration: windows of sound and acceleration, groups of repetitions left out, the learner chosen
// on the training part. With "every", the ten learners of the 2023 paper are evaluated under the
// paper's protocol and under this one. Vibration is evaluated only; no model is saved. Imprints:
// Ellis' experiments and a model.

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

/// The first keys of evaluation.json: bench, campaign, digests and version.
nlohmann::ordered_json handover_heading_json(const DatasetInfo& info,
                                             const std::string& dataset_sha256);
/// The entry of evaluation.json about a model in a file: the number of training trials, and the
/// cross-validated accuracy.
nlohmann::ordered_json model_line_json(const std::string& name, const HandoverText& model,
                                       const std::string& learner, std::size_t trials,
                                       const classifier::Evaluation& evaluation);

// The handover of a campaign of presses: the experiments of Ellis 1986 on its imprints, and a model
// of all imprints.

/// Returns the content of evaluation.json; adds imprints.html, imprints.json and imprints.model to
/// `texts`. Makes the tables of daemon/analysis/imprint on the complete trials of `data`, with all
/// scales, forms and rules. Trains a model with the defaults of `weft imprint train`; its accuracy
/// leaves out one object at a time. Errors: a data set without imprints; those of the rules and
/// learners; wrong_state if stopped.
Result<nlohmann::ordered_json> run_imprint_handover(
    const Dataset& data, const std::string& dataset_sha256, const recipes::Handover& wanted,
    const HandoverHooks& hooks, const StopRequested& stop, std::vector<HandoverText>& texts);

/// The complete trials of one exploration, and the repetition of each.
struct LearningMaterial {
  std::string exploration;
  std::vector<classifier::Trial> trials;
  std::vector<std::uint32_t> repetition;  ///< from 1; same order as trials
};

struct TrainingResult {
  LearningMaterial material;
  classifier::StoredModel model;  ///< trained on all trials
  std::string learner;            ///< description of the learner
  classifier::Evaluation evaluation;
  std::vector<classifier::Split> splits;
  std::size_t features = 0;
  double train_s = 0;  ///< training time of the model, measured [s]
};
/// `options` includes the stop. Errors: the classifier's.
Result<TrainingResult> train_exploration(const Dataset& dataset, const std::string& exploration,
                                         const std::string& dataset_sha256,
                                         const recipes::Handover& wanted, std::uint32_t repetitions,
                                         const classifier::TrainOptions& options,
                                         const HandoverHooks& hooks,
                                         const std::function<void(const std::string&)>& announce);

/// Entry of evaluation.json.
nlohmann::ordered_json training_json(const TrainingResult& training_result);
/// Page with the same results.
Document training_document(const DatasetInfo& info, const recipes::Handover& wanted,
                           const TrainingResult& training_result);

/// Phase M of the complete trials of one exploration. A recording's group is that of its
/// repetition, named from "1": `group_of[i]` is for repetition i + 1 (see
/// recipes::repetition_groups()). Errors: extract_recordings()'s.
Result<RecordingSet> vibration_material(const Dataset& dataset, const std::string& exploration,
                                        const std::vector<std::size_t>& group_of);

/// Accuracy on groups of repetitions that neither the learner nor its choice has seen.
struct ChosenLearner {
  double window_s = 0, step_s = 0;
  std::size_t windows = 0, columns = 0, groups = 0;
  classifier::vibro::CrossValidation result;  ///< its `chosen`: the choice for each group left out
};

struct VibrationTrainingResult {
  ChosenLearner best;
  VibroTradeoff tradeoff;  ///< for "every"; otherwise without points
  std::vector<std::string> materials;
};

/// `announce` is called before each of the vibration_steps(wanted). `stop` is checked before each
/// training. Errors: recordings too short for a window of 2 s; the classifier's.
Result<VibrationTrainingResult> train_vibration(
    const RecordingSet& set, const recipes::Handover& wanted, const HandoverHooks& hooks,
    const StopRequested& stop, const std::function<void(const std::string&)>& announce);
std::size_t vibration_steps(const recipes::Handover& wanted);

/// One-line result. `file`: its page.
HandoverEvaluation make_evaluation(const std::string& exploration, const std::string& file,
                                   const RecordingSet& set,
                                   const VibrationTrainingResult& training_result);
/// Entry of evaluation.json.
nlohmann::ordered_json vibration_json(const RecordingSet& set,
                                      const VibrationTrainingResult& training_result);
/// Page with the same results: accuracy, confusion by material, macro F-score against time, the
/// paper's tables.
Result<Document> vibration_document(const std::string& exploration, const RecordingSet& set,
                                    const VibrationTrainingResult& training_result);

/// Adds NAME.html and NAME.json, the record from which the page is drawn. Errors:
/// page_of_record()'s.
Status add_page(const std::string& name, const nlohmann::ordered_json& record,
                const Document& document, std::vector<HandoverText>& texts);

}  // namespace weft::daemon
