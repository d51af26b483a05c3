#pragma once
// The emulator of a tactile array in a rig file.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "protocols/base/result.hpp"
#include "sim/devices/taxel_emulator.hpp"

namespace weft::sim {

/// Reads {"kind": "taxel", ...} at `where`, a JSON pointer: form, rows and cols or positions_mm,
/// rate_hz, noise_counts, largest_chunk_bytes. Errors: parse, below `where`.
Result<TaxelEmulatorParams> read_taxels(const nlohmann::json& emulator, const std::string& where);

}  // namespace weft::sim
