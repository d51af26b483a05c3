#pragma once
// "finally" of a recipe.

#include "recipes/engine/plan.hpp"
#include "recipes/schema/object_reader.hpp"

namespace weft::recipes {

/// Places are checked against the travel of the stages.
Finally read_finally(ObjectReader& recipe, const RigLimits& limits, Problems& problems);

}  // namespace weft::recipes
