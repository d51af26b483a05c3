#pragma once
// One fault as a rig file or an order writes it.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "sim/rig/rig_config.hpp"

namespace weft::sim {

/// Whom of exposed:: the device of this emulator is.
std::uint8_t exposure_of(const EmulatedDevice& device);

/// {"device", "fault", "start_s" 0, "duration_s" (for ever), "probability" 1, "amount" (the
/// kind's), "towards" "host" | "device"}; start_s counts from `origin`. Errors: parse, range,
/// not_found (device, kind) and unsupported (a kind that cannot befall the device), below `where`,
/// a JSON pointer.
Result<DeviceFault> read_fault(const nlohmann::json& object, const std::string& where,
                               const std::vector<EmulatedDevice>& devices, TimePoint origin);

}  // namespace weft::sim
