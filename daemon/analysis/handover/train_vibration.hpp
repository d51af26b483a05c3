#pragma once
// One exploration of a hand-over from vibration: windows of sound and acceleration, groups of
// repetitions left out, the learner chosen on what trains; with "every" the ten learners of the
// 2023 paper under its own protocol and under this one. Evaluated only: no model is kept.

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "classifier/vibro/cross_validation.hpp"
#include "daemon/analysis/handover/handover.hpp"
#include "daemon/analysis/tradeoff/measure_vibro.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/recordings/recording_set.hpp"

namespace weft::daemon {

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
/// The page of the same: F-score against time, the paper's tables, confusion by material.
Result<std::string> vibration_html(const std::string& exploration, const RecordingSet& set,
                                   const VibrationTrainingResult& training_result);

}  // namespace weft::daemon
