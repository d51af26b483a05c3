#pragma once
// The recipe's "sweep": its factors, which of their combinations are done, and in which order.

#include "recipes/engine/recipe_reader.hpp"
#include "recipes/schema/object_reader.hpp"

namespace weft::recipes {

/// Reads the sweep, where the recipe has one, and says of "repetitions", "order" and "hand_over"
/// that they do not go with it. The explorations must have been read.
void read_sweep(ObjectReader& recipe, const RigLimits& limits, StatedRecipe& stated,
                Problems& problems);

}  // namespace weft::recipes
