#pragma once
// Importance of the features of a trained learner, the paper's selection by importance, and the
// accuracy with the selected features.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "classifier/evaluate/splits.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/vibro/extract.hpp"
#include "classifier/vibro/protocol.hpp"

namespace weft::classifier::vibro {

/// Importance of one feature: the loss of accuracy when its values are shuffled among the rows.
struct Importance {
  double mean = 0.0;
  double deviation = 0.0;  ///< over the repeats
};

/// Permutation importance (Breiman 2001; the paper uses that of Eli5) of every feature, on rows
/// outside the training. Refuses no repeats, no rows and what classify() refuses.
Result<std::vector<Importance>> permutation_importance(const TrainedLearner& learner,
                                                       const Matrix& rows,
                                                       std::span<const std::size_t> of_row,
                                                       std::size_t repeats, std::uint64_t seed);

/// The `count` features with the largest mean, most important first. For equal means the larger
/// value in `ties` comes first, then the lower index. The paper kept five of its ten.
std::vector<std::size_t> most_important(std::span<const Importance> importance, std::size_t count,
                                        std::span<const double> ties = {});

/// Weight of each feature, by both methods of the paper.
struct Weighed {
  std::vector<Importance> permutation;  ///< on the test windows of each split, mean over the splits
  std::vector<double> forest;  ///< on the training windows, mean over the splits; the sum is 1
};

/// Repeats `repeats` times on every split. `options` as for cross_validate(), including seed and
/// trees of the forest. Refuses no splits, and what its parts refuse.
Result<Weighed> weigh_features(const WindowSet& windows, std::span<const Split> splits,
                               const Recipe& recipe, const TrainOptions& options,
                               std::size_t repeats);

/// Accuracy on windows with some of the columns.
struct Reached {
  double accuracy = 0.0;  ///< mean over the splits
  double f_score = 0.0;   ///< macro, mean over the splits
  std::vector<double> split_accuracy{};
  std::vector<std::vector<std::size_t>> retained{};  ///< columns, per split
};

/// For every split: selects the `count` most important columns from the training windows alone,
/// then trains and tests the recipe with them. The selection permutes columns on inner folds of the
/// training windows (class_folds()), or on the training windows themselves if there are no folds.
/// Refuses no splits, count 0, and what its parts refuse.
Result<Reached> reach_by_selection(const WindowSet& windows, std::span<const Split> splits,
                                   const Recipe& recipe, const TrainOptions& options,
                                   std::size_t count, std::size_t repeats);

/// The same with given columns, on every split.
Result<Reached> reach_with(const WindowSet& windows, std::span<const Split> splits,
                           const Recipe& recipe, const TrainOptions& options,
                           std::span<const std::size_t> columns);

}  // namespace weft::classifier::vibro
