#pragma once
// What `weft ... evaluate` is asked and what it measures, before it is shown.

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

/// Which trials train and which test.
struct SplitChoice {
  std::vector<std::string> train_groups;
  std::vector<std::string> test_groups;
  double train_fraction = 0.0;  ///< 0: by groups, or what suits the data set
  bool leave_one_group_out = false;
};
/// `fraction` and `leave_out` say what the last two are for.
void add_split_options(CLI::App& command, SplitChoice& choice, const std::string& fraction,
                       const std::string& leave_out);

struct EvaluateArgs : SplitChoice {
  std::filesystem::path dataset;
  std::size_t repeats = 30;
  std::size_t permute_labels = 0;  ///< permutations to try as well; 0: none
  std::vector<std::string> learners = {"every"};
  std::vector<std::size_t> curve;  ///< training recordings of each label; empty: all
  bool calibration = false;        ///< probabilities of test answers too; --report implies it
  bool none_of_these = false;      ///< every fabric left out in turn and shown
  std::filesystem::path report;    ///< page to write; empty: none
  bool answers = false;            ///< with --json: list them
  std::size_t curve_draws = 5;     ///< of each split and number
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
  /// What words_of() says of the folds of its trainings, where they are not those asked for, and of
  /// how many trainings.
  std::map<std::string, std::size_t> folds = {};
  /// On the same splits, each taxel's mean of phase M subtracted: see Measured::confounded.
  std::optional<classifier::Scores> level_removed = {};
  [[nodiscard]] std::string name() const { return std::string(classifier::to_string(learner)); }
};

/// Everything that was measured on the splits.
struct Measured {
  std::vector<classifier::Split> splits;
  std::vector<Outcome> outcomes;     ///< in the order asked for
  std::vector<GroupLeftOut> groups;  ///< with --leave-one-group-out
  std::vector<CurvePoint> curve;     ///< with --learning-curve, by rising number of trials
  std::vector<classifier::NeverTested> never_tested;  ///< labels that no split tests
  classifier::DuplicateRows duplicates;  ///< test trials that are copies of training trials
  std::vector<std::string> groups_on_both_sides;  ///< of a random split
  std::vector<Warning> warnings;                  ///< of the samples
  /// Label and mounting, see shares_mountings(); of slides alone. Outcomes then have level_removed,
  /// unless the level was removed anyway; of choices, which train often, only where nothing else
  /// was asked for.
  bool confounded = false;
};

/// Refuses what make_splits(), evaluate() and thinned() refuse, and with --none-of-these what
/// check_labels_can_be_left_out() does; but for what a training alone can tell, before the first.
Result<Measured> measure(const EvaluateArgs& args, const ChosenTrials& chosen);

/// Features of one trial: mean over up to 16, each extracted once before, as its tables are made by
/// then, on one thread [s]. 0 where features were not of whole single trials, or fail.
double seconds_of_features(const TrialChoice& choice, const ChosenTrials& chosen,
                           const classifier::SecondsNow& seconds_now);

/// "lda" or "lda (4 splits), svc (1 splits)": what a choice came to, and how often.
std::string chosen_text(const classifier::Evaluation& evaluation);

/// Errors of the candidates in cross-validation: "lda 5/644; trees 3/129, then dropped; ...", and
/// which were not tried (format_skipped()).
std::string tried_text(const std::vector<classifier::RecipeScore>& scores);

/// What became of each candidate, one that was not tried included.
nlohmann::json candidates_json(const std::vector<classifier::RecipeScore>& scores);

}  // namespace weft::daemon::cli
