#pragma once
// Which features a trained pipeline leans on, and the paper's selection by that.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "classifier/evaluate/splits.hpp"
#include "classifier/vibro/extract.hpp"
#include "classifier/vibro/learn/pipeline.hpp"

namespace weft::classifier::vibro {

/// Of one feature: how much of the accuracy goes when its values are dealt out at random among the
/// rows.
struct Importance {
  double mean = 0.0;
  double deviation = 0.0;  ///< over the repeats
};

/// Permutation importance (Breiman 2001; what the paper takes from Eli5) of every feature on rows
/// that did not train. Refuses no repeats, no rows and what classify() refuses.
Result<std::vector<Importance>> permutation_importance(const Pipeline& pipeline, const Matrix& rows,
                                                       std::span<const std::size_t> of_row,
                                                       std::size_t repeats, std::uint64_t seed);

/// The `count` features of the largest mean, most important first; equal ones in their order. The
/// paper kept five of its ten.
std::vector<std::size_t> most_important(std::span<const Importance> importance, std::size_t count);

/// How much each feature weighs, by both of the ways that the paper used.
struct Weighed {
  std::vector<Importance> permutation;  ///< on the test windows of each split, mean over the splits
  std::vector<double> forest;  ///< of the training windows, mean over the splits; its sum is 1
};

/// `repeats` times on every split; `options` as for assess(), its forest's seed and trees too.
/// Refuses no splits, and what its parts refuse.
Result<Weighed> weigh_features(const WindowSet& windows, std::span<const Split> splits,
                               const PipelineOptions& options, std::size_t repeats);

}  // namespace weft::classifier::vibro
