#pragma once
// The classification of a campaign: each exploration, each way of reducing the features.

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
  std::uint64_t seed = 1;       ///< of splits and folds
  std::size_t threads = 0;      ///< 0: one per core; the figures do not depend on it
  /// The trials' groups are left out in turn, in the place of random splits.
  bool leave_groups_out = false;
  /// Of the splits so many, at most, are tried without levels too where label and mounting are
  /// confounded.
  std::size_t level_splits = 10;
  /// Of the splits so many, at most, are tried with Learner::best too, which trains some hundred
  /// times as long; 0: none.
  std::size_t best_splits = 0;
  std::function<bool()> stop = {};  ///< asked often, on several threads
};

/// What a choice by cross-validation comes to.
struct BestResult {
  classifier::Scores scores;     ///< on the first splits
  double permuted_accuracy = 0;  ///< labels in random order
};

struct ReductionResult {
  classifier::Reduction reduction = classifier::Reduction::pvalue;
  classifier::Evaluation evaluation;
};

struct ExplorationResult {
  std::string exploration;  ///< "M1"
  std::size_t trials = 0;   ///< complete ones, all of which were used
  std::size_t features = 0;
  std::size_t threads = 0;  ///< that trained; features and test are timed on one
  /// Mean over a sample of the trials, one at a time on one thread [s].
  double feature_s_per_sample = 0;
  /// p-value method with labels in random order, mean over several permutations with a split each:
  /// what chance looks like.
  double permuted_accuracy = 0;
  std::vector<ReductionResult> reductions;  ///< pvalue, pca, all
  bool confounded = false;                  ///< label and mounting, see shares_mountings()
  /// The same on the first splits, each pad's mean of phase M subtracted; empty: not confounded.
  std::vector<ReductionResult> level_removed;
  std::optional<BestResult> best;  ///< where it was asked for

  /// nullptr when it was not evaluated.
  [[nodiscard]] const classifier::Evaluation* find(classifier::Reduction reduction) const;
};

/// nullptr when it is not among them.
const classifier::Evaluation* find(const std::vector<ReductionResult>& results,
                                   classifier::Reduction reduction);

/// How the intervals were computed, for the reader of a report.
std::string interval_methods(const std::vector<ExplorationResult>& results);

/// Told before each step.
struct EvaluationProgress {
  std::size_t step = 0;
  std::size_t steps = 0;
  std::string what;  ///< "M1: features of 340 trials"
};
using EvaluationSink = std::function<void(const EvaluationProgress&)>;

/// What is new in a test trial.
enum class Repeated : std::uint8_t {
  unknown,   ///< the data set does not say
  touch,     ///< nothing else: path, mounting and piece are those of training trials
  patch,     ///< the place on the mounted piece
  mounting,  ///< and how it was mounted
  piece      ///< and the piece
};
/// By what the data set says of its trials.
Repeated repeated_in(const Dataset& dataset);
/// "another touch of the same path", for a table and a sentence.
std::string_view to_string(Repeated repeated);

/// A campaign beside another one, which differs from it in what a repetition is.
struct CampaignBeside {
  std::string name;
  Repeated repeated = Repeated::unknown;
  std::size_t trials = 0;
  std::vector<ExplorationResult> results;
};
/// Several pieces, else several mountings, are left out in turn. Errors: evaluate_campaign()'s.
Result<CampaignBeside> evaluate_beside(Dataset dataset, EvaluateOptions options,
                                       const EvaluationSink& progress = {});

/// Tells `sink`, which may be empty, of each step before it starts.
struct StepAnnouncer {
  EvaluationSink sink;
  EvaluationProgress progress = {};
  void operator()(const std::string& what) {
    progress.what = what;
    if (sink) sink(progress);
    ++progress.step;
  }
};

/// Explorations in order of their first trial; only complete trials take part. Refuses what the
/// classifier refuses (a label with one trial, a single label), a data set without complete trials.
Result<std::vector<ExplorationResult>> evaluate_campaign(const Dataset& dataset,
                                                         const EvaluateOptions& options,
                                                         const classifier::SecondsNow& seconds_now,
                                                         const EvaluationSink& progress = {});

}  // namespace weft::daemon
