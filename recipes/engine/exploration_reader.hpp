#pragma once
// One exploration of a recipe: its phases in order, and where it touches down.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "recipes/engine/recipe_reader.hpp"

namespace weft::recipes {

StatedExploration read_exploration(const std::string& name, const nlohmann::json& value,
                                   const std::string& pointer, const RigLimits& limits,
                                   Problems& problems);

}  // namespace weft::recipes
