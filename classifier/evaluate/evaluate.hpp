#pragma once
// Train and test over one or more splits, and what Tables II to IV of Khan et al. 2016 show of it.

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

/// Reads a clock in seconds. The caller's: nothing here knows what time it is. Empty: times are
/// reported as 0.
using SecondsNow = std::function<double()>;

/// One training and test.
struct SplitOutcome {
  double accuracy = 0.0;
  double train_s = 0.0;            ///< all cores, grid search included
  double test_s_per_sample = 0.0;  ///< one trial at a time on one thread, vote included
};

/// What came out over all splits.
struct Scores {
  Confusion confusion;  ///< summed over the splits
  std::vector<SplitOutcome> splits;
  /// Of each split, of its test rows in order: index into confusion.labels.
  std::vector<std::vector<std::size_t>> answers;
  double accuracy = 0.0;  ///< mean over the splits
  double deviation = 0.0;
  Interval ci95;
  double train_s = 0.0;            ///< mean over the splits
  double test_s_per_sample = 0.0;  ///< mean over the splits
  double answer_s = 0.0;           ///< of one row: the median of all
};

struct Evaluation : Scores {
  /// Of each split: what was trained, and the candidates where that was a choice.
  std::vector<Recipe> recipes;
  std::vector<std::vector<RecipeScore>> candidates;
  TrainedLearner trained;  ///< of the first split
  /// Principal components that were taken, the most of any split, and the share of the variance
  /// that they explain, mean over the splits; 0 and 1 without them.
  std::size_t components = 0;
  double explained = 1.0;
  /// Of each label, training rows left out as outliers, over all splits; empty: none looked for.
  std::map<std::string, std::size_t> outliers = {};
  std::optional<CalibrationCheck> calibration = {};  ///< where it was asked for
};

/// Trains on every split by train_best(), a choice and its cross-validation included, and tests.
/// With `calibration` each split's aids are learnt as well, outside the times, and the
/// probabilities of its test answers compared with what came true. Refuses: what train_best()
/// refuses, no split, an empty test part, a row beyond the last, a row on both sides of a split, a
/// test label that was not trained.
Result<Evaluation> evaluate(const FeatureMatrix& matrix, std::span<const Split> splits,
                            std::span<const Recipe> candidates, const TrainOptions& options,
                            const SecondsNow& seconds_now = {}, bool calibration = false);

/// The same of candidates(learner, options.cap).
Result<Evaluation> evaluate(const FeatureMatrix& matrix, std::span<const Split> splits,
                            Learner learner, const TrainOptions& options,
                            const SecondsNow& seconds_now = {}, bool calibration = false);

// What the method reaches when there is nothing to learn: labels in random order.

struct PermutationOptions {
  double train_fraction = 0.4;
  std::size_t permutations = 10;
  std::size_t splits =
      1;  ///< of each permutation; further permutations tell more than further splits
};

struct PermutationResult {
  std::vector<double> accuracy;  ///< per permutation, mean over its splits
  double mean = 0.0;
  /// Expected accuracy of the answers given, were they independent of the labels: 1 / labels where
  /// every label has as many trials.
  double chance = 0.0;
  std::size_t trials = 0;  ///< tested, over all permutations and splits
};

/// Shuffles the labels of all trials, then draws stratified splits, trains and tests with the
/// shuffled labels; once per permutation. With one split each, correct answers over all
/// permutations are a sum of independent matches, of a variance at most n / (n - 1) that of a
/// binomial with `chance`. Whatever exceeds that means that labels reach the answers on another way
/// than through the features. Seeds follow from `train.seed`. Refuses what stratified_splits() and
/// evaluate() refuse, and no permutation.
Result<PermutationResult> evaluate_permuted(const FeatureMatrix& matrix,
                                            std::span<const Recipe> candidates,
                                            const TrainOptions& train,
                                            const PermutationOptions& options = {});

/// The same of candidates(learner, train.cap).
Result<PermutationResult> evaluate_permuted(const FeatureMatrix& matrix, Learner learner,
                                            const TrainOptions& train,
                                            const PermutationOptions& options = {});

}  // namespace weft::classifier
