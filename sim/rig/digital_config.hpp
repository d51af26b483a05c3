#pragma once
// The `emulator` of a device of kind "ati_digital".

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "protocols/base/result.hpp"
#include "sim/devices/ati_digital_emulator.hpp"

namespace weft::sim {

/// Errors: parse and range below `where`, a JSON pointer.
Result<AtiDigitalParams> read_digital(const nlohmann::json& emulator, const std::string& where);

}  // namespace weft::sim
