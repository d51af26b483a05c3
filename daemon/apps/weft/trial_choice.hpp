#pragma once
// From a data set file to the feature matrix of a command: chosen trials, whole or in windows.

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

/// Options shared by features, train and evaluate.
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
  GivenOptions given = {};                    ///< of the command; other kinds are refused
  CommandModality modality = {};              ///< the command's: other data are refused
};
void add_trial_options(CLI::App& command, const LearningOptions& options, TrialChoice& choice);
/// --group.
void add_group_option(CLI::App& command, std::string& group);
/// `--remove-level`, for commands that make no model: a model file does not store it.
void add_level_option(CLI::App& command, TrialChoice& choice);

/// Sets the groups from a column. Errors: those of group_labels().
Status set_groups(Dataset& dataset, std::string_view by);
Status set_groups(RecordingSet& set, std::string_view by);

/// Samples of phase M of the shortest and the longest whole stroke.
struct MotionLengths {
  std::size_t shortest = 0;
  std::size_t longest = 0;
};

/// A data set and the features of its chosen trials.
struct ChosenTrials {
  Dataset dataset;
  std::string sha256;
  std::size_t strokes = 0;  ///< chosen trials before cutting into windows
  classifier::FeatureMatrix features;
  classifier::FeatureSetup setup;
  MotionLengths motion;  ///< 0 for windows, imprints and joined explorations
  /// For imprints, in place of the setup: the features taken from each.
  std::optional<classifier::imprint::FeaturePlan> imprint_plan = {};
  /// content_digest() of each row's trial, window or imprint; empty for joined explorations.
  std::vector<std::uint64_t> digests = {};
  /// For imprints without features named by the user: `features` and the maps behind them, from
  /// which `best` chooses.
  std::optional<classifier::FeatureMatrix> with_maps = {};
};

/// Imprints have their own features. Errors: those of feature_plan_from() and build_matrix().
Result<ChosenTrials> load_imprints(const Dataset& dataset, const TrialChoice& choice);

/// The candidates that a learner tries, and their features. Refers to the chosen trials.
struct LearningTask {
  const classifier::FeatureMatrix& matrix;
  std::vector<classifier::Recipe> candidates;
};
LearningTask learning_task(const ChosenTrials& chosen, classifier::Learner learner,
                           std::size_t cap);

/// Complete trials, and their common properties.
struct TrialSelection {
  std::string exploration;  ///< of all; empty if several or unnamed
  std::size_t strokes = 0;  ///< before cutting into windows
  std::vector<classifier::Trial> trials;
};

/// The exploration named `wanted`; empty: the only one. No value: all, for cells of a sweep (not in
/// `one_exploration` mode). Refuses a missing one, and several without a name: M1 and M2 are
/// different experiments.
Result<std::optional<std::string>> find_exploration(const Dataset& dataset,
                                                    const std::string& wanted,
                                                    bool one_exploration);

/// Complete trials of the exploration that `choice` names, or of the only one, cut into windows if
/// requested. Errors: those of find_exploration().
Result<TrialSelection> choose_trials(const Dataset& dataset, const TrialChoice& choice,
                                     bool one_exploration);

/// The windows of each complete trial of an exploration in turn (none across a pause). Returns
/// whole trials if `options.window_s` is 0. Refuses windows of recordings with an unknown sample
/// period.
Result<std::vector<classifier::Trial>> in_windows(const Dataset& dataset,
                                                  const std::optional<std::string>& exploration,
                                                  const classifier::WindowOptions& options);

/// Applies classifier::without_level() if `choice` requests it.
Status remove_level(classifier::Trial& trial, const TrialChoice& choice);

/// Reads `path`, chooses trials and extracts features. An exploration such as "M1+M2" joins the
/// features of both side by side, "M1:range.M.4". It makes a row for every label, group and
/// repetition with one complete trial of each. This needs `can_join`, for commands that make no
/// model, and whole strokes. Errors: also those of check_given() for the kind of data in the file.
Result<ChosenTrials> load_trials(const std::filesystem::path& path, const TrialChoice& choice,
                                 bool one_exploration, bool can_join = false);

/// The features of the same slides, in the same order, without the level of their motion.
Result<classifier::FeatureMatrix> features_without_level(const ChosenTrials& chosen,
                                                         TrialChoice choice);

/// Slides, or imprints.
DataKind kind_of(const Dataset& dataset);
/// Refuses data of another modality than the command's, and names the right command. Errors: also
/// those of check_given() for their kind.
Status check_command(const TrialChoice& choice, DataKind kind);

/// Mean sample period of a data set [s]; 0 when not known.
double sample_period_s(const Dataset& dataset);

/// Refuses a trial (of `exploration`, or of all) with another rate than a model's, according to
/// can_have_period(). `period_s`: the model's sample period [s]; 0 if unknown.
Status check_rate(const Dataset& dataset, const std::optional<std::string>& exploration,
                  double period_s);

/// "SIMULATED data ..." or "" for real data; starts every text with results.
std::string bench_banner(BenchKind kind);
/// Also with format_selection(), so that the text shows that a live vote ended trials early.
std::string bench_banner(const DatasetInfo& info);

}  // namespace weft::daemon::cli
