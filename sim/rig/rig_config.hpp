#pragma once
// The part of a rig file that describes its emulation, in SI.

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocols/base/result.hpp"
#include "sim/devices/apt_stage_emulator.hpp"
#include "sim/devices/bench_world.hpp"
#include "sim/devices/rdt_emulator.hpp"
#include "sim/devices/taxel_emulator.hpp"
#include "sim/plant/fabric.hpp"

namespace weft::sim {

struct EmulatedDevice {
  std::string name;
  std::variant<AptStageParams, RdtEmulatorParams, TaxelEmulatorParams> params;
};

struct RigConfig {
  WorldParams world;
  MaterialSwitches switches;
  std::vector<EmulatedDevice> devices;
};

/// Reads `devices[].role`, `devices[].emulator`, `limits.travel_mm`, `probe`, `plate` and
/// `simulation`; other keys belong to others. `simulation` and `emulator` are read strictly.
/// Errors: parse and range, with a JSON pointer.
Result<RigConfig> parse_rig_config(std::string_view rig_json);

}  // namespace weft::sim
