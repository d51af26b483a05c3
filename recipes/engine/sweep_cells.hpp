#pragma once
// Every exploration of a swept recipe in every cell.

#include "recipes/engine/recipe_reader.hpp"

namespace weft::recipes {

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
