#pragma once
// The `emulator` entry of an imprint array.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "sim/devices/imprint_emulator.hpp"

namespace weft::sim {

/// Errors: parse, range, and unsupported for a level that does not press statically; below `where`.
Result<ImprintEmulatorParams> read_imprint(const nlohmann::json& emulator,
                                           const std::string& where);

}  // namespace weft::sim
