#pragma once
// Which features a trained pipeline leans on, and the paper's selection by that.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

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

}  // namespace weft::classifier::vibro
