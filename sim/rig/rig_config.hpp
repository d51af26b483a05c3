#pragma once
// The part of a rig file that describes its emulation, in SI.

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

/// Where a rig file names the level.
inline constexpr const char* level_place = "/simulation/level";

struct EmulatedDevice {
  std::string name;
  std::variant<AptStageParams, RdtEmulatorParams, AtiDigitalParams, TaxelEmulatorParams,
               VibroEmulatorParams, ImprintEmulatorParams>
      params;
};

/// A fault and whom it befalls.
struct DeviceFault {
  std::string device;
  Fault fault;
};

struct RigConfig {
  BenchPlantParams bench_plant;
  /// What the devices deliver, and `simulation.traits`.
  Scene scene{"of the bench", {}, {}};
  /// `simulation.level` names the level; otherwise it is the least that provides the scene.
  bool level_by_hand = false;
  /// `simulation.chosen`: how an earlier run came to its setting, and to which.
  std::string chosen_setting, chosen_because;
  bool set_point_by_hand = false;  ///< `simulation.set_point_n` is there
  MaterialSwitches switches;
  std::vector<EmulatedDevice> devices;
  std::vector<DeviceFault> faults;  ///< `simulation.faults`
};

/// Of the sensor, where the rig file does not say: the fabric table's.
struct SensorParams {
  Cover cover;
  PadParams pads;
};

/// Reads `devices[].role`, `devices[].emulator`, `limits.travel_mm`, `probe`, `plate` and
/// `simulation`; other keys belong to others. `simulation` and `emulator` are read strictly.
/// Only what the scene needs is set to be computed.
/// Errors: parse and range, and unsupported for a level that cannot produce the scene, with a JSON
/// pointer.
Result<RigConfig> parse_rig_config(std::string_view rig_json, const SensorParams& sensor = {});

/// One entry of a rig file's `devices`: reads `name`, `role` and `emulator`; a stage's travel goes
/// into the world of `config`. Errors: parse and range below `where`, a JSON pointer; unsupported
/// for a sensor that no emulator plays.
Result<EmulatedDevice> read_device(const nlohmann::json& device, const std::string& where,
                                   RigConfig& config);

/// nullptr for a name that the rig file does not have.
const EmulatedDevice* find_device(const std::vector<EmulatedDevice>& devices,
                                  std::string_view name);

/// Whom of exposed:: the device of this emulator is.
std::uint8_t exposure_of(const EmulatedDevice& device);

/// {"device", "fault", "start_s" 0, "duration_s" (for ever), "probability" 1, "amount" (the
/// kind's), "towards" "host" | "device"}; start_s counts from `origin`. Errors: parse, range,
/// not_found (device, kind) and unsupported (a kind that cannot befall the device), below `where`,
/// a JSON pointer.
Result<DeviceFault> read_fault(const nlohmann::json& object, const std::string& where,
                               const std::vector<EmulatedDevice>& devices, TimePoint origin);

}  // namespace weft::sim
