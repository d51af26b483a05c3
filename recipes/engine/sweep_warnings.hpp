#pragma once
// What of a sweep can be done but not analysed.

#include <vector>

#include "recipes/engine/plan.hpp"

namespace weft::recipes {

/// What weft design analyse asks of every cell (docs/design.md, "What is compared"): its learner
/// leaves each of three replicates out, its spectrum wants 8 samples of phase M, its noise 3 of P.
inline constexpr std::size_t least_swept_fabrics = 2, least_swept_replicates = 3,
                             least_motion_samples = 8, least_press_samples = 3;

/// Warnings, not problems: a sweep may be done for its forces or imprints, which ask for less. One
/// for each exploration and reason, about its shortest cell. Nothing for a plan without a sweep.
std::vector<Diagnostic> warnings_about_sweep(const Plan& plan);

}  // namespace weft::recipes
