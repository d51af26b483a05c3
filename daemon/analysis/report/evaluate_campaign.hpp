#pragma once
// The classification of a campaign: each exploration with each reduction of the features.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

struct EvaluateOptions {
  double train_fraction = 0.4;  ///< paper, section IV-B
  std::size_t repeats = 30;     ///< random splits; the paper averages over 30 trials
  std::uint64_t seed = 1;       ///< seed of splits and folds
  std::size_t threads = 0;      ///< 0: one per core; results do not depend on it
  /// Leaves out the trials' groups in turn, instead of using random splits.
  bool leave_groups_out = false;
  /// If label and mounting are confounded: number of splits that are also tried without levels.
  std::size_t level_splits = 10;
  /// Number of splits that are also tried with Learner::best, which trains about a hundred times as
  /// long; 0: none.
  std::size_t best_splits = 0;
  std::function<bool()> stop = {};  ///< called often, on several threads
};

/// Result of the learner chosen by cross-validation.
struct BestResult {
  classifier::Scores scores;     ///< on the first splits
  double permuted_accuracy = 0;  ///< with shuffled labels
};

struct ReductionResult {
  classifier::Reduction reduction = classifier::Reduction::pvalue;
  classifier::Evaluation evaluation;
};

struct ExplorationResult {
  std::string exploration;  ///< "M1"
  std::size_t trials = 0;   ///< complete ones; all are used
  std::size_t features = 0;
  std::size_t threads = 0;  ///< training threads; features and tests are timed on one thread
  /// Mean over a sample of the trials, computed one at a time on one thread [s].
  double feature_s_per_sample = 0;
  /// Accuracy of the p-value method with shuffled labels: the chance level. Mean over several
  /// permutations with one split each.
  double permuted_accuracy = 0;
  std::vector<ReductionResult> reductions;  ///< pvalue, pca, all
  bool confounded = false;                  ///< label and mounting are confounded, see
                                            ///< shares_mountings()
  /// The same reductions on the first splits, with each taxel's mean of phase M subtracted; empty:
  /// not confounded.
  std::vector<ReductionResult> level_removed;
  std::optional<BestResult> best;  ///< only if requested

  /// nullptr if this reduction was not evaluated.
  [[nodiscard]] const classifier::Evaluation* find(classifier::Reduction reduction) const;
};

/// nullptr if there is no such result.
const classifier::Evaluation* find(const std::vector<ReductionResult>& results,
                                   classifier::Reduction reduction);

/// How the intervals were computed, for the reader of a report.
std::string interval_methods(const std::vector<ExplorationResult>& results);

/// Passed to the sink before each step.
struct EvaluationProgress {
  std::size_t step = 0;
  std::size_t steps = 0;
  std::string what;  ///< "M1: features of 340 trials"
};
using EvaluationSink = std::function<void(const EvaluationProgress&)>;

/// How a test trial differs from the training trials.
enum class Repeated : std::uint8_t {
  unknown,   ///< not recorded in the data set
  touch,     ///< another touch only: path, mounting and piece are those of training trials
  patch,     ///< another patch of the mounted piece
  mounting,  ///< another mounting as well
  piece      ///< another piece as well
};
/// Determined from the recorded places of the trials.
Repeated repeated_in(const Dataset& dataset);
/// "another touch of the same path", for a table and a sentence.
std::string_view to_string(Repeated repeated);

/// A campaign for comparison; it differs in what a repetition is.
struct CampaignBeside {
  std::string name;
  Repeated repeated = Repeated::unknown;
  std::size_t trials = 0;
  std::vector<ExplorationResult> results;
};
/// Leaves out several pieces, or else several mountings, in turn. Errors: evaluate_campaign()'s.
Result<CampaignBeside> evaluate_beside(Dataset dataset, EvaluateOptions options,
                                       const EvaluationSink& progress = {});

/// Calls `sink`, which may be empty, before each step.
struct StepAnnouncer {
  EvaluationSink sink;
  EvaluationProgress progress = {};
  void operator()(const std::string& what) {
    progress.what = what;
    if (sink) sink(progress);
    ++progress.step;
  }
};

/// Explorations in order of their first trial; only complete trials are used. Errors: a data set
/// without complete trials; those of the classifier (a label with one trial, a single label).
Result<std::vector<ExplorationResult>> evaluate_campaign(const Dataset& dataset,
                                                         const EvaluateOptions& options,
                                                         const classifier::SecondsNow& seconds_now,
                                                         const EvaluationSink& progress = {});

}  // namespace weft::daemon
