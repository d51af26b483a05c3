#pragma once
// "operator_steps" of a recipe.

#include "recipes/engine/recipe_reader.hpp"
#include "recipes/schema/object_reader.hpp"

namespace weft::recipes {

/// After the fabrics, which a step may name.
void read_operator_steps(ObjectReader& recipe, StatedRecipe& stated, Problems& problems);

}  // namespace weft::recipes
