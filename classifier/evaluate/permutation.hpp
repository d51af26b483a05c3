#pragma once
// What the method reaches when there is nothing to learn: labels in random order.

#include <cstddef>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"

namespace weft::classifier {

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
Result<PermutationResult> evaluate_permuted(const FeatureMatrix& matrix, const TrainOptions& train,
                                            const PermutationOptions& options = {});

/// The same for any learner.
Result<PermutationResult> evaluate_permuted(const FeatureMatrix& matrix, Learner learner,
                                            const TrainOptions& train,
                                            const PermutationOptions& options = {});

}  // namespace weft::classifier
