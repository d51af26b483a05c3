#pragma once
// From a data set file to the feature matrix of a command: which trials, whole or in windows.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "classifier/features/feature_matrix.hpp"
#include "classifier/features/trial.hpp"
#include "classifier/imprint/imprint_set.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/model/stored_model.hpp"
#include "daemon/apps/weft/imprint_features.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/recordings/recording_set.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::cli {

/// Options that features, train and evaluate share.
struct TrialChoice {
  std::string exploration;     ///< empty: the only one, or all; see choose_trials()
  double window_s = 0.0;       ///< 0: whole strokes
  double window_step_s = 0.0;  ///< 0: no overlap
  std::string norm = "l2";
  std::string scales = "0,1,2,3,4";           ///< of imprints [taxels], as in FeaturePlan
  std::string imprint_features = "10+laws5";  ///< see feature_plan_from()
  EdgeChoice edges = {};                      ///< of imprints
  std::string group = "recorded";             ///< see set_groups()
  std::string remove_level = {};              ///< "", "motion" or "rest"; see remove_level()
  GivenOptions given = {};  ///< of the whole command: those not of the data's kind are refused
  CommandModality modality = {};  ///< the command's: other data are refused
};
void add_trial_options(CLI::App& command, const LearningOptions& options, TrialChoice& choice);
/// --group.
void add_group_option(CLI::App& command, std::string& group);
/// --remove-level, for commands that make no model: a model file does not know of it.
void add_level_option(CLI::App& command, TrialChoice& choice);

/// Makes the groups those of a column: group_labels(), whose errors it has.
Status set_groups(Dataset& dataset, std::string_view by);
Status set_groups(RecordingSet& set, std::string_view by);

/// Samples of phase M of the shortest and the longest whole stroke.
struct MotionLengths {
  std::size_t shortest = 0;
  std::size_t longest = 0;
};

/// A data set and the features of the trials that were chosen from it.
struct ChosenTrials {
  Dataset dataset;
  std::string sha256;
  std::size_t strokes = 0;  ///< chosen trials before they were cut into windows
  classifier::FeatureMatrix features;
  classifier::FeatureSetup setup;
  MotionLengths motion;  ///< 0 of windows, of imprints, and of explorations side by side
  /// Of imprints, in the place of the setup: what was taken of each.
  std::optional<classifier::imprint::FeaturePlan> imprint_plan = {};
  /// content_digest() of each row's trial, window or imprint; none of explorations side by side.
  std::vector<std::uint64_t> digests = {};
  /// Of imprints whose features the user has not named: `features` and the maps behind them, from
  /// which `best` chooses.
  std::optional<classifier::FeatureMatrix> with_maps = {};
};

/// Imprints have features of their own. Errors: those of feature_plan_from() and build_matrix().
Result<ChosenTrials> load_imprints(const Dataset& dataset, const TrialChoice& choice);

/// What a learner tries, on which features. Refers to the trials that were chosen.
struct LearningTask {
  const classifier::FeatureMatrix& matrix;
  std::vector<classifier::Recipe> candidates;
};
LearningTask learning_task(const ChosenTrials& chosen, classifier::Learner learner,
                           std::size_t cap);

/// Complete trials, and what they have in common.
struct TrialSelection {
  std::string exploration;  ///< of all of them; empty when several were taken, or none is named
  std::size_t strokes = 0;  ///< before they were cut into windows
  std::vector<classifier::Trial> trials;
};

/// The exploration that `wanted` means; empty: the only one there is. Nothing: all, cells of a
/// sweep (not in `one_exploration` mode). Refuses one that is not there, and several of them
/// without a name: M1 and M2 are different experiments.
Result<std::optional<std::string>> find_exploration(const Dataset& dataset,
                                                    const std::string& wanted,
                                                    bool one_exploration);

/// Complete trials of the exploration that `choice` names, or of the only one there is, cut into
/// windows where asked for; refuses what find_exploration() refuses.
Result<TrialSelection> choose_trials(const Dataset& dataset, const TrialChoice& choice,
                                     bool one_exploration);

/// The windows of each complete trial of an exploration in turn (none across a pause); the trials
/// as they are when `options.window_s` is 0. Refuses windows of recordings whose sample period is
/// not known.
Result<std::vector<classifier::Trial>> in_windows(const Dataset& dataset,
                                                  const std::optional<std::string>& exploration,
                                                  const classifier::WindowOptions& options);

/// What `choice` says of it: classifier::without_level(), or nothing.
Status remove_level(classifier::Trial& trial, const TrialChoice& choice);

/// Reads `path`, chooses and extracts. An exploration such as "M1+M2" puts the features of both
/// side by side, "M1:range.M.4": a row for every label, group and repetition that has one complete
/// trial of each. Only with `can_join`, for commands that make no model, and only whole strokes.
/// Refuses what check_given() refuses of the kind that the file turns out to hold.
Result<ChosenTrials> load_trials(const std::filesystem::path& path, const TrialChoice& choice,
                                 bool one_exploration, bool can_join = false);

/// The features of the same slides, in the same order, without the level of their motion.
Result<classifier::FeatureMatrix> features_without_level(const ChosenTrials& chosen,
                                                         TrialChoice choice);

/// Slides, or imprints.
DataKind kind_of(const Dataset& dataset);
/// Refuses data of another modality than the command's, naming the command's of theirs, and what
/// check_given() refuses of their kind.
Status check_command(const TrialChoice& choice, DataKind kind);

/// Mean sample period of a data set [s]; 0 when not known.
double sample_period_s(const Dataset& dataset);

/// Refuses a trial (of `exploration`, or of all) that is of another rate than those of a model,
/// whose sample period is `period_s` (0: not known), as can_have_period() tells.
Status check_rate(const Dataset& dataset, const std::optional<std::string>& exploration,
                  double period_s);

/// "SIMULATED data ..." or "" for real data: every text with figures starts with it.
std::string bench_banner(BenchKind kind);
/// And with format_selection(): nobody trains on what a live vote left without being told.
std::string bench_banner(const DatasetInfo& info);

}  // namespace weft::daemon::cli
