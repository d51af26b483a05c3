#pragma once
// `weft vibro evaluate` on recordings of sound and vibration.

#include <cstddef>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "classifier/vibro/importance.hpp"
#include "classifier/vibro/recording.hpp"
#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/options.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::cli {

// `weft vibro evaluate --importance`: features of sound and vibration that a learner relies on.

/// Number of features that the paper kept of its ten.
inline constexpr std::size_t features_selected = 5;

/// Weighs the columns of `windows` on the splits, and adds the result to `json` and to the returned
/// text: permutation of test windows by the recipe, and a forest of training windows. Then compares
/// the recipe on the paper's five columns, on all, and on selected ones. The same permutation
/// selects these on folds of the training windows of each split. Errors: those of weigh_features()
/// and reach_by_selection().
Result<std::string> add_importance(const classifier::vibro::WindowSet& windows,
                                   std::span<const classifier::Split> splits,
                                   const classifier::Recipe& recipe,
                                   const classifier::TrainOptions& options, std::size_t repeats,
                                   nlohmann::json& json);

struct EvaluateArgs;
struct TrialChoice;
/// Whether a command is about recordings. Commands of a modality know; for others, if the file
/// holds recordings or one of their options was given.
bool is_about_recordings(const TrialChoice& choice, const std::filesystem::path& file,
                         bool is_requested);

/// Options of evaluate for recordings, beside those for slides.
struct RecordingChoice {
  std::vector<std::string> methods;  ///< learners; "every", "best"; empty: best
  std::string protocol = "blocks";
  std::string features;  ///< empty: best chooses, others use SMMRPFFT
  std::string combine = "concat";
  std::size_t components = 0;
  double outliers = 0.0;  ///< classifier::TrainOptions::outliers
  double step_s = 0.25;
  std::size_t blocks = 5;
  std::size_t per_recording = 100;
  std::size_t importance = 0;  ///< repeats of the permutation; 0: none
};
/// --outliers.
CLI::Option* add_outliers_option(CLI::App& command, double& outliers);
void add_recording_options(CLI::App& command, LearningOptions& options, RecordingChoice& choice);
/// Adds the options for turning recordings into rows of features.
void add_recording_feature_options(LearningOptions& options, RecordingChoice& choice);
/// Also those for changing the rows before a learner gets them.
void add_row_options(LearningOptions& options, RecordingChoice& choice);
/// Parses the feature options. Errors: unknown names.
Result<classifier::vibro::FeatureChoice> parse_feature_choice(const RecordingChoice& choice);
/// ", training windows beyond 3 standard deviations left out"; empty for 0. `found`: per label, as
/// TrainedLearner::outliers(); appended as " (felt 2, foil 0)".
std::string format_outliers(double deviations,
                            const std::map<std::string, std::size_t>& found = {});
/// "lda on WIDE", "lda".
std::string format_chosen(const classifier::Recipe& recipe);

Result<int> run_evaluate_recordings(const EvaluateArgs& args, Console& console);

}  // namespace weft::daemon::cli
