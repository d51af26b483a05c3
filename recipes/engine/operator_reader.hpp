#pragma once
// "operator_steps" of a recipe.

#include "recipes/engine/plan.hpp"
#include "recipes/engine/recipe_reader.hpp"
#include "recipes/schema/object_reader.hpp"

namespace weft::recipes {

/// Places are checked against the travel of the stages.
Finally read_finally(ObjectReader& recipe, const RigLimits& limits, Problems& problems);

/// After the fabrics, which a step may name.
void read_operator_steps(ObjectReader& recipe, StatedRecipe& stated, Problems& problems);

}  // namespace weft::recipes
