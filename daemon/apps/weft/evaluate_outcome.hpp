#pragma once
// What `weft evaluate` measures, before it is shown.

#include <map>
#include <string>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/evaluate/splits.hpp"
#include "daemon/analysis/report/evaluation_page.hpp"
#include "daemon/apps/weft/evaluate_command.hpp"

namespace weft::daemon::cli {

struct Outcome {
  classifier::Learner learner = classifier::Learner::pvalue;
  classifier::LearnerEvaluation evaluation;
  /// What words_of() says of the folds of its trainings, where they are not those asked for, and of
  /// how many trainings.
  std::map<std::string, std::size_t> folds = {};
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
};

/// Of the words of --learner; "every" is all but cores-best.
Result<std::vector<classifier::Learner>> parse_learners(const std::vector<std::string>& words);

/// best or cores-best.
bool is_choice(classifier::Learner learner);

classifier::TrainOptions make_options(const EvaluateArgs& args);

/// Refuses what make_splits(), evaluate() and thinned() refuse, and with --none-of-these what
/// check_labels_can_be_left_out() does; but for what a training alone can tell, before the first.
Result<Measured> measure(const EvaluateArgs& args, const ChosenTrials& chosen);

/// Features of one trial: mean over up to 16, each extracted once before, as its tables are made by
/// then. 0 where features were not of whole single trials.
double seconds_of_features(const TrialChoice& choice, const ChosenTrials& chosen,
                           const classifier::SecondsNow& seconds_now);

/// "lda" or "lda (4 splits), svc (1 splits)": what a choice came to, and how often.
std::string chosen_text(const classifier::LearnerEvaluation& evaluation);

/// Errors of the candidates in cross-validation: "lda 5/644; trees 3/129, then dropped; ...".
std::string tried_text(const std::vector<classifier::RecipeScore>& scores);

/// How the trials were split, in words.
std::string split_text(const EvaluateArgs& args, const std::vector<classifier::Split>& splits);

}  // namespace weft::daemon::cli
