#pragma once
// One exploration of a recipe: its phases in order, and where it touches down.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "recipes/engine/recipe_reader.hpp"
#include "recipes/schema/object_reader.hpp"

namespace weft::recipes {

/// Reads the recipe's "classes", where it has them: the class of each of `fabrics`, or nothing.
/// Problems: fewer than two classes, a class without a fabric, a fabric that the recipe does not
/// have, has in two classes or in none.
std::vector<std::string> read_classes(ObjectReader& recipe, const std::vector<std::string>& fabrics,
                                      Problems& problems);

StatedExploration read_exploration(const std::string& name, const nlohmann::json& value,
                                   const std::string& pointer, const RigLimits& limits,
                                   Problems& problems);

}  // namespace weft::recipes
