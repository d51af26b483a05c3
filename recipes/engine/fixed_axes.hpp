#pragma once
// The axes that a rig has no stage for: `fixed` of the rig file says where each of them stands.

#include <nlohmann/json_fwd.hpp>

#include "recipes/kinematics/kinematics.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::recipes {

/// Reads {"fixed": {"y_mm": 75, "rx_deg": 0, "ry_deg": 0}} of a rig file, or the same in m and rad:
/// a fixed axis has no travel but the place where it stands. x and z cannot be fixed.
/// Errors, with their JSON pointers, go into `problems`.
void read_fixed_axes(const nlohmann::json& rig, Geometry& geometry, Problems& problems);

}  // namespace weft::recipes
