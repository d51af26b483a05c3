#pragma once
// The order of a campaign's trials.

#include <vector>

#include "recipes/engine/recipe_reader.hpp"

namespace weft::recipes {

/// Blocked: fabric by fabric, in each exploration by exploration, in each repetition by repetition.
/// Randomised: the blocked list shuffled (Fisher and Yates) by splitmix64 from the order's seed.
std::vector<TrialSpec> ordered_trials(const StatedRecipe& stated);

}  // namespace weft::recipes
