#pragma once
// The part of a rig file that describes its emulation, in SI units.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocols/base/result.hpp"
#include "sim/devices/apt_stage_emulator.hpp"
#include "sim/devices/ati_digital_emulator.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/devices/faults/fault.hpp"
#include "sim/devices/imprint_emulator.hpp"
#include "sim/devices/rdt_emulator.hpp"
#include "sim/devices/taxel_emulator.hpp"
#include "sim/devices/vibro_emulator.hpp"
#include "sim/plant/fabric.hpp"
#include "sim/plant/scene/scene.hpp"

namespace weft::sim {

/// Place of the level in a rig file.
inline constexpr const char* level_place = "/simulation/level";

struct EmulatedDevice {
  std::string name;
  std::variant<AptStageParams, RdtEmulatorParams, AtiDigitalParams, TaxelEmulatorParams,
               VibroEmulatorParams, ImprintEmulatorParams>
      params;
};

/// A fault and its device.
struct DeviceFault {
  std::string device;
  Fault fault;
};

struct RigConfig {
  BenchPlantParams bench_plant;
  /// The channels of the devices, and `simulation.traits`.
  Scene scene{"of the bench", {}, {}};
  /// True if `simulation.level` names the level; otherwise it is the least one that provides the
  /// scene.
  bool level_by_hand = false;
  /// `simulation.chosen`: the setting that an earlier run chose, and its reason.
  std::string chosen_setting, chosen_because;
  bool set_point_by_hand = false;  ///< `simulation.set_point_n` is present
  MaterialSwitches switches;
  std::vector<EmulatedDevice> devices;
  std::vector<DeviceFault> faults;  ///< `simulation.faults`
};

/// Defaults of the sensor from the fabric table, for rig files without these keys.
struct SensorParams {
  Cover cover;
  PadParams pads;
};

/// Reads `devices[].role`, `devices[].emulator`, `limits.travel_mm`, `probe`, `plate` and
/// `simulation`. Other keys are ignored, except in `simulation` and `emulator`, where unknown keys
/// are errors. Only the needs of the scene are enabled in the plant. Errors: parse and range, and
/// unsupported for a level that cannot produce the scene, with a JSON pointer.
Result<RigConfig> parse_rig_config(std::string_view rig_json, const SensorParams& sensor = {});

/// Reads one entry of a rig file's `devices`: `name`, `role` and `emulator`. The travel of a stage
/// goes into the plant parameters of `config`. Errors: parse and range below `where`, a JSON
/// pointer; unsupported for a sensor without an emulator.
Result<EmulatedDevice> read_device(const nlohmann::json& device, const std::string& where,
                                   RigConfig& config);

/// nullptr for a name that the rig file does not have.
const EmulatedDevice* find_device(const std::vector<EmulatedDevice>& devices,
                                  std::string_view name);

/// Bits of exposed:: for the device of this emulator.
std::uint8_t exposure_of(const EmulatedDevice& device);

/// Reads {"device", "fault", "start_s" 0, "duration_s" (unlimited), "probability" 1, "amount" (the
/// kind's), "towards" "host" | "device"}; start_s counts from `origin`. Errors below `where`, a
/// JSON pointer: parse, range, not_found (device, kind) and unsupported (a kind that cannot be
/// injected into the device).
Result<DeviceFault> read_fault(const nlohmann::json& object, const std::string& where,
                               const std::vector<EmulatedDevice>& devices, TimePoint origin);

}  // namespace weft::sim
