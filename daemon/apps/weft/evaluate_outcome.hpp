#pragma once
// Options and measurements of `weft ... evaluate`, before they are shown.

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/evaluate/splits.hpp"
#include "daemon/analysis/report/evaluation_page.hpp"
#include "daemon/apps/weft/evaluate_recordings.hpp"
#include "daemon/apps/weft/train_command.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/storage/dataset/data_warnings.hpp"

namespace weft::daemon::cli {

/// Division of the trials into training and test.
struct SplitChoice {
  std::vector<std::string> train_groups;
  std::vector<std::string> test_groups;
  double train_fraction = 0.0;  ///< 0: by groups, or by the data set
  bool leave_one_group_out = false;
};
/// `fraction` and `leave_out`: help texts of the last two options.
void add_split_options(CLI::App& command, SplitChoice& choice, const std::string& fraction,
                       const std::string& leave_out);

struct EvaluateArgs : SplitChoice {
  std::filesystem::path dataset;
  std::size_t repeats = 30;
  std::size_t permute_labels = 0;  ///< number of permutations to try too; 0: none
  std::vector<std::string> learners = {"every"};
  std::vector<std::size_t> curve;  ///< training recordings of each label; empty: all
  bool calibration = false;        ///< also probabilities; --report implies it
  bool none_of_these = false;      ///< test each fabric with a model without it
  std::filesystem::path report;    ///< page to write; empty: none
  bool answers = false;            ///< with --json: list predictions
  std::size_t curve_draws = 5;     ///< for each split and number
  TrialChoice trials;
  TrainChoice training;
  RecordingChoice recordings;
};
void add_options(CLI::App& command, EvaluateArgs& args);

/// One split by groups, one for each group left out, or `repeats` random ones. Refuses random
/// splits of windows: windows of one recording would be on both sides.
Result<std::vector<classifier::Split>> make_splits(const EvaluateArgs& args,
                                                   const classifier::FeatureMatrix& features);

struct Outcome {
  classifier::Learner learner = classifier::Learner::pvalue;
  classifier::Evaluation evaluation;
  /// format_folds() of the trainings with other folds than requested, and the number of these
  /// trainings.
  std::map<std::string, std::size_t> folds = {};
  /// On the same splits, with each taxel's mean of phase M subtracted: see Measured::confounded.
  std::optional<classifier::Scores> level_removed = {};
  [[nodiscard]] std::string name() const { return std::string(classifier::to_string(learner)); }
};

/// All measurements on the splits.
struct Measured {
  std::vector<classifier::Split> splits;
  std::vector<Outcome> outcomes;     ///< in the order of --learner
  std::vector<GroupLeftOut> groups;  ///< with --leave-one-group-out
  std::vector<CurvePoint> curve;     ///< with --learning-curve, by rising number of trials
  std::vector<classifier::NeverTested> never_tested;  ///< labels that no split tests
  classifier::DuplicateRows duplicates;  ///< test trials that are copies of training trials
  std::vector<std::string> groups_on_both_sides;  ///< of a random split
  std::vector<Warning> warnings;                  ///< about the samples
  /// Label and mounting are confounded, see shares_mountings(); for slides only. Outcomes then have
  /// level_removed, unless the level was removed anyway. Choices, which train often, have it only
  /// if all requested learners are choices.
  bool confounded = false;
};

/// Errors: those of make_splits(), evaluate() and thinned(); with --none-of-these those of
/// check_labels_can_be_left_out(). They are found before the first training, unless only a training
/// can find them.
Result<Measured> measure(const EvaluateArgs& args, const ChosenTrials& chosen);

/// Time to extract the features of one trial [s]: mean over up to 16, on one thread, each extracted
/// once before so that its tables exist. 0 if features are not of whole single trials, or fail.
double seconds_of_features(const TrialChoice& choice, const ChosenTrials& chosen,
                           const classifier::SecondsNow& seconds_now);

/// "lda" or "lda (4 splits), svc (1 split)": the chosen recipes, and how often.
std::string chosen_text(const classifier::Evaluation& evaluation);

/// "lda 5 errors of 644, 3 others tried (see --json)": the best candidate in cross-validation, and
/// the untried ones (format_skipped()).
std::string tried_text(const std::vector<classifier::RecipeScore>& scores);

/// Result of each candidate, including untried ones.
nlohmann::json candidates_json(const std::vector<classifier::RecipeScore>& scores);

}  // namespace weft::daemon::cli
