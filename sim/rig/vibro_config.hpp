#pragma once
// The `emulator` of a device of kind "vibro".

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "protocols/base/result.hpp"
#include "sim/devices/vibro_emulator.hpp"

namespace weft::sim {

/// The plant's sensors, `plant`, are set up to sample as the emulator does; without a rate they are
/// left out. Errors: parse and range below `where`, a JSON pointer.
Result<VibroEmulatorParams> read_vibro(const nlohmann::json& emulator, const std::string& where,
                                       VibrationParams& plant);

}  // namespace weft::sim
