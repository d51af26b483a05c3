#pragma once
// The sensors of a rig file: rates, taxels, noise, and missing sensors.

#include <nlohmann/json_fwd.hpp>

#include "recipes/engine/rig_limits.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::recipes {

/// Whether a device of the rig file has this role; true if the file lists no devices.
bool has_role(const nlohmann::json& rig, const char* role);

/// Reads the stream settings of the sensors' drivers; the drivers check the rest. Errors go into
/// `problems`. has_wrench must be set.
void read_sensors(const nlohmann::json& rig, RigLimits& limits, Problems& problems);

}  // namespace weft::recipes
