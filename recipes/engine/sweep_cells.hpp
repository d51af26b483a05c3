#pragma once
// Every exploration of a swept recipe in every cell.

#include <vector>

#include "recipes/engine/plan.hpp"
#include "recipes/engine/recipe_reader.hpp"

namespace weft::recipes {

// What of a sweep can be done but not analysed.

/// What weft design analyse asks of every cell (docs/design.md, "What is compared"): its learner
/// leaves each of three replicates out, its spectrum wants 8 samples of phase M, its noise 3 of P.
inline constexpr std::size_t least_swept_fabrics = 2, least_swept_replicates = 3,
                             least_motion_samples = 8, least_press_samples = 3;

/// Warnings, not problems: a sweep may be done for its forces or imprints, which ask for less. One
/// for each exploration and reason, about its shortest cell. Nothing for a plan without a sweep.
std::vector<Diagnostic> warnings_about_sweep(const Plan& plan);

/// Sets start_m of the exploration. Every corner must keep the probe's whole face on the plate and
/// every stage within its travel; legs are straight and both regions are convex, so corners
/// suffice.
void place_on_plate(StatedExploration& stated, const RigLimits& limits, Problems& problems);

/// Puts every exploration in every cell: afterwards there is one for each cell of each, named
/// "M1-5N-2mm_s", with its values in the place of the phases' own. For a recipe without problems
/// whose explorations have been placed on the plate; a stroke that is swept is placed anew. Without
/// a sweep nothing happens.
void spread_sweep(StatedRecipe& stated, const RigLimits& limits, Problems& problems);

/// With the first value of each factor: what the phases state of a factor is of no account.
Exploration at_first_values(const Exploration& exploration, const Sweep& sweep);

/// Whether the sweep varies this.
bool varies(const Sweep& sweep, FactorKind kind);

}  // namespace weft::recipes
