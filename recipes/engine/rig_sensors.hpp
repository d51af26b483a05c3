#pragma once
// The sensors of a rig file: rates, taxels, noise, and what the rig does without.

#include <nlohmann/json_fwd.hpp>

#include "recipes/engine/rig_limits.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::recipes {

/// Whether a device of the rig file has this role; true where it lists no devices at all.
bool has_role(const nlohmann::json& rig, const char* role);

/// What the sensors' drivers are told of their streams; the drivers themselves check the rest.
/// Errors go into `problems`. has_wrench must be set.
void read_sensors(const nlohmann::json& rig, RigLimits& limits, Problems& problems);

}  // namespace weft::recipes
