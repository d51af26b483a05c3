#pragma once
// One entry of a rig file's `devices`: what its emulator is.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "sim/rig/rig_config.hpp"

namespace weft::sim {

/// Reads `name`, `role` and `emulator`; a stage's travel goes into the world of `config`.
/// Errors: parse and range below `where`, a JSON pointer; unsupported for a sensor that no emulator
/// plays.
Result<EmulatedDevice> read_device(const nlohmann::json& device, const std::string& where,
                                   RigConfig& config);

}  // namespace weft::sim
