#pragma once
// Checks the roles of a rig file's devices: every axis is a device's role or fixed.

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"
#include "recipes/kinematics/kinematics.hpp"

namespace weft::daemon {

/// Position of each axis without a stage [m] or [rad].
using FixedAxes = std::array<std::optional<double>, recipes::axis_count>;

/// "x, y, z, rx, ry, wrench, taxels or vibro".
bool is_role(std::string_view role);
inline constexpr std::string_view all_roles = "x, y, z, rx, ry, wrench, taxels or vibro";

/// Reads `fixed` of a rig file. Errors: invalid_argument, with a JSON pointer.
Result<FixedAxes> read_fixed(const nlohmann::json& rig);

/// Errors: invalid_argument if a role occurs too often, or if an axis is neither a device's role
/// nor fixed, or both.
Status roles_filled(const std::vector<std::string>& roles, const FixedAxes& fixed);

}  // namespace weft::daemon
