#pragma once
// Which features a trained learner leans on, the paper's selection by that, and what it reaches.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "classifier/evaluate/splits.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/vibro/extract.hpp"
#include "classifier/vibro/protocol.hpp"

namespace weft::classifier::vibro {

/// Of one feature: how much of the accuracy goes when its values are dealt out at random among the
/// rows.
struct Importance {
  double mean = 0.0;
  double deviation = 0.0;  ///< over the repeats
};

/// Permutation importance (Breiman 2001; what the paper takes from Eli5) of every feature on rows
/// that did not train. Refuses no repeats, no rows and what classify() refuses.
Result<std::vector<Importance>> permutation_importance(const TrainedLearner& learner,
                                                       const Matrix& rows,
                                                       std::span<const std::size_t> of_row,
                                                       std::size_t repeats, std::uint64_t seed);

/// The `count` features of the largest mean, most important first; equal ones by what `ties` has of
/// them, the larger first, then in their order. The paper kept five of its ten.
std::vector<std::size_t> most_important(std::span<const Importance> importance, std::size_t count,
                                        std::span<const double> ties = {});

/// How much each feature weighs, by both of the ways that the paper used.
struct Weighed {
  std::vector<Importance> permutation;  ///< on the test windows of each split, mean over the splits
  std::vector<double> forest;  ///< of the training windows, mean over the splits; its sum is 1
};

/// `repeats` times on every split; `options` as for cross_validate(), seed and trees of the forest
/// too. Refuses no splits, and what its parts refuse.
Result<Weighed> weigh_features(const WindowSet& windows, std::span<const Split> splits,
                               const Recipe& recipe, const TrainOptions& options,
                               std::size_t repeats);

/// Windows right with some of the columns.
struct Reached {
  double accuracy = 0.0;  ///< mean over the splits
  double f_score = 0.0;   ///< macro, mean over the splits
  std::vector<double> split_accuracy{};
  std::vector<std::vector<std::size_t>> retained{};  ///< columns, per split
};

/// On every split the `count` columns that matter most to the training windows alone are selected,
/// by permutation of parts of them left out in turn (class_folds(); where there are none, of
/// themselves), and the recipe is trained with these and tested. Refuses no
/// splits, count 0, and what its parts refuse.
Result<Reached> reach_by_selection(const WindowSet& windows, std::span<const Split> splits,
                                   const Recipe& recipe, const TrainOptions& options,
                                   std::size_t count, std::size_t repeats);

/// The same with columns that are given, on every split.
Result<Reached> reach_with(const WindowSet& windows, std::span<const Split> splits,
                           const Recipe& recipe, const TrainOptions& options,
                           std::span<const std::size_t> columns);

}  // namespace weft::classifier::vibro
