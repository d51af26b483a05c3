#pragma once
// Training and testing over one or more splits, with the results of Tables II to IV of Khan et al.
// 2016.

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/evaluate/calibration_check.hpp"
#include "classifier/evaluate/splits.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learners/learner.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Reads a clock in seconds; the caller provides it, as this module has no clock. Empty: times are
/// reported as 0.
using SecondsNow = std::function<double()>;

/// One training and test.
struct SplitOutcome {
  double accuracy = 0.0;
  double train_s = 0.0;            ///< all cores, grid search included
  double test_s_per_sample = 0.0;  ///< one trial at a time on one thread, vote included
};

/// Results over all splits.
struct Scores {
  Confusion confusion;  ///< summed over the splits
  std::vector<SplitOutcome> splits;
  /// For each split and each of its test rows in order: index into confusion.labels.
  std::vector<std::vector<std::size_t>> answers;
  double accuracy = 0.0;  ///< mean over the splits
  double deviation = 0.0;
  Interval ci95;
  double train_s = 0.0;            ///< mean over the splits
  double test_s_per_sample = 0.0;  ///< mean over the splits
  double answer_s = 0.0;           ///< seconds for one row: the median of all rows
};

struct Evaluation : Scores {
  /// For each split: the trained recipe, and the candidates where there was a choice.
  std::vector<Recipe> recipes;
  std::vector<std::vector<RecipeScore>> candidates;
  TrainedLearner trained;  ///< learner of the first split
  /// Number of principal components used (the largest of any split), and the share of the variance
  /// that they explain (mean over the splits); 0 and 1 without them.
  std::size_t components = 0;
  double explained = 1.0;
  /// For each label: training rows left out as outliers, over all splits. Empty: outliers were not
  /// searched.
  std::map<std::string, std::size_t> outliers = {};
  std::optional<CalibrationCheck> calibration = {};  ///< only if requested
};

/// Trains on every split by train_best(), a choice and its cross-validation included, and tests.
/// With `calibration` it also fits each split's postprocessing, outside the measured times, and
/// compares the probabilities of the test answers with the outcomes. Refuses: what train_best()
/// refuses, no split, an empty test part, a row out of range, a row on both sides of a split, a
/// test label that was not trained.
Result<Evaluation> evaluate(const FeatureMatrix& matrix, std::span<const Split> splits,
                            std::span<const Recipe> candidates, const TrainOptions& options,
                            const SecondsNow& seconds_now = {}, bool calibration = false);

/// The same with candidates(learner, options.cap).
Result<Evaluation> evaluate(const FeatureMatrix& matrix, std::span<const Split> splits,
                            Learner learner, const TrainOptions& options,
                            const SecondsNow& seconds_now = {}, bool calibration = false);

// Accuracy with labels in random order, when there is nothing to learn.

struct PermutationOptions {
  double train_fraction = 0.4;
  std::size_t permutations = 10;
  std::size_t splits =
      1;  ///< per permutation; more permutations give more information than more splits
};

struct PermutationResult {
  std::vector<double> accuracy;  ///< per permutation, mean over its splits
  double mean = 0.0;
  /// Expected accuracy if the answers were independent of the labels: 1 / labels where every label
  /// has the same number of trials.
  double chance = 0.0;
  std::size_t trials = 0;  ///< tested trials, over all permutations and splits
};

/// Shuffles the labels of all trials, then draws stratified splits, trains and tests with the
/// shuffled labels, once per permutation. With one split each, the correct answers over all
/// permutations are a sum of independent matches. Its variance is at most n / (n - 1) that of a
/// binomial with `chance`. A larger number shows that labels reach the answers other than through
/// the features. Seeds follow from `train.seed`. Refuses what stratified_splits() and evaluate()
/// refuse, and no permutation.
Result<PermutationResult> evaluate_permuted(const FeatureMatrix& matrix,
                                            std::span<const Recipe> candidates,
                                            const TrainOptions& train,
                                            const PermutationOptions& options = {});

/// The same with candidates(learner, train.cap).
Result<PermutationResult> evaluate_permuted(const FeatureMatrix& matrix, Learner learner,
                                            const TrainOptions& train,
                                            const PermutationOptions& options = {});

}  // namespace weft::classifier
