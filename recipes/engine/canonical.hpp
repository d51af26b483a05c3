#pragma once
// The normal form of a recipe, for its digest.

#include <string>

#include "recipes/engine/recipe_reader.hpp"

namespace weft::recipes {

/// Sorted keys, SI units, defaults and chosen starts written out; description and source left out.
/// Numbers are the shortest that read back as the same double.
std::string canonical_json(const StatedRecipe& stated);

}  // namespace weft::recipes
