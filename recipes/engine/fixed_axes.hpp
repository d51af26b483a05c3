#pragma once
// Axes without a stage: `fixed` in the rig file gives their positions.

#include <nlohmann/json_fwd.hpp>

#include "recipes/kinematics/kinematics.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::recipes {

/// Reads {"fixed": {"y_mm": 75, "rx_deg": 0, "ry_deg": 0}} of a rig file, or the same in m and rad.
/// The travel of a fixed axis is only its position. x and z cannot be fixed.
/// Errors: collected in `problems`, each with its JSON pointer.
void read_fixed_axes(const nlohmann::json& rig, Geometry& geometry, Problems& problems);

}  // namespace weft::recipes
