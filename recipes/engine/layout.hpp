#pragma once
// Where explorations lie on the plate: chosen when the recipe leaves it open, checked in any case.

#include "recipes/engine/recipe_reader.hpp"

namespace weft::recipes {

/// Sets start_m of the exploration. Every corner must keep the probe's whole face on the plate and
/// every stage within its travel; legs are straight and both regions are convex, so corners
/// suffice.
void place_on_plate(StatedExploration& stated, const RigLimits& limits, Problems& problems);

}  // namespace weft::recipes
