#pragma once
// One entry of a rig file's `devices`: what its emulator is.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "protocols/base/result.hpp"
#include "sim/devices/vibro_emulator.hpp"
#include "sim/rig/rig_config.hpp"

namespace weft::sim {

/// The plant's sensors, `plant`, are set up to sample as the emulator does; without a rate they are
/// left out. Errors: parse and range below `where`, a JSON pointer.
Result<VibroEmulatorParams> read_vibro(const nlohmann::json& emulator, const std::string& where,
                                       VibrationParams& plant);

/// Reads `name`, `role` and `emulator`; a stage's travel goes into the world of `config`.
/// Errors: parse and range below `where`, a JSON pointer; unsupported for a sensor that no emulator
/// plays.
Result<EmulatedDevice> read_device(const nlohmann::json& device, const std::string& where,
                                   RigConfig& config);

}  // namespace weft::sim
