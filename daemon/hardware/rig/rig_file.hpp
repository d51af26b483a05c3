#pragma once
// The rig file: which devices a bench has, how they are reached, and what the bench allows.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "daemon/base/text/format.hpp"
#include "daemon/hardware/link/port_link.hpp"
#include "daemon/hardware/plugins/driver_catalog.hpp"
#include "daemon/hardware/rig/roles.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

// How a device is reached: the `link` of a rig file's device.

/// Inside this process, to an emulator.
struct MemoryPort {};
struct TcpPort {
  Endpoint end;
};
struct UdpPort {
  Endpoint end;
  /// The host's own port, for a device that sends there unasked; 0: any.
  std::uint16_t local_port = 0;
};

/// Where host and device meet: the host opens it, weft-rig serves it.
using LinkSettings = std::variant<MemoryPort, SerialSettings, TcpPort, UdpPort>;

/// Reads one link: {"kind": "memory" | "serial" | "tcp" | "udp", ...}; nothing or {} is memory.
/// serial: path, baud, parity (none, even, odd), rts_cts, ftdi_start_up; tcp and udp: host, port;
/// udp: local_port. Errors: parse, invalid_argument (kind, key, type) and range, below `where`, a
/// JSON pointer.
Result<LinkSettings> parse_link(std::string_view json, std::string_view where);

/// Opens the host's end. Errors: those of the port; wrong_state for memory, which is not a port.
Result<std::unique_ptr<Link>> open_link(RealLoop& loop, const LinkSettings& settings);

struct DeviceEntry {
  std::string name;         ///< "stage.z"
  std::string role;         ///< "x", "y", "z", "rx", "ry", "wrench", "taxels", "vibro"
  std::string driver;       ///< name of a driver plugin
  std::string config_json;  ///< handed to the driver, see driver_config()
  /// Of the rig's limits, for a linear stage [mm/s2].
  std::optional<double> acceleration_mm_s2 = {};
  std::string acceleration_limit;  ///< where the rig file has it: "/limits/acceleration_mps2"
  bool noiseless =
      false;  ///< simulated without noise: it says so of itself, recipes::lacks_noise()
  std::string emulated_model, emulated_stage;  ///< of its emulator, where the file names them
  LinkSettings link;
  std::vector<LinkSettings> also;        ///< emulated: weft-rig serves the same device there too
  std::optional<LinkSettings> http;      ///< the page of the device's settings, where it has one
  std::optional<LinkSettings> commands;  ///< emulated: weft-rig serves the device's command port
};

/// Opens the page of a device behind a port; null where it has none. Errors: those of the port, at
/// /http.
Result<std::unique_ptr<Link>> open_page(RealLoop& loop, const DeviceEntry& device);

/// What stands behind the links, and whose time passes.
enum class BenchMode : std::uint8_t {
  simulated,  ///< emulators in this process, virtual time; every link is in memory
  emulated,   ///< emulators in weft-rig, behind real ports, real time
  real        ///< devices
};

/// The part of a rig file that wires devices. Limits are read by recipes::parse_rig_limits, the
/// emulators' part by sim::Rig::create, from the same text.
struct RigFile {
  std::string name;
  BenchMode mode = BenchMode::simulated;
  BenchKind bench = BenchKind::unknown;  ///< of the data: those of an emulated bench are simulated
  Endpoint console;  ///< emulated: where weft-rig takes orders, `simulation.console` {host, port}
  std::string plant_level;  ///< fidelity of the plant, "L1"; empty on a real bench
  std::vector<DeviceEntry> devices;
  FixedAxes fixed;                             ///< of the axes that no device has as its role
  std::vector<std::filesystem::path> plugins;  ///< folders with drivers, relative to the file
  std::shared_ptr<DriverCatalog> drivers;      ///< where the devices' drivers come from
  std::string text;                            ///< the whole file, as recorded with the campaign
};

/// Errors: parse with line and column, and invalid_argument (unknown keys, a link that the bench
/// cannot have) with a JSON pointer.
Result<RigFile> parse_rig_file(std::string_view text);

/// The configuration of a device as its driver takes it: a linear stage whose driver knows the key
/// `acceleration_mm_s2` is told the rig's limit by it. Errors: those of DriverCatalog::source();
/// invalid_argument, where the rig file has another value there, for plan, force loop and guards
/// count on the limit's, or a key whose link (`x-link` of its schema) the device does not have.
Result<std::string> driver_config(const DeviceEntry& entry, DriverCatalog& drivers);

/// What a driver says of such a configuration; of a limit that was sent, at the limit.
Error in_rig_file(const DeviceEntry& entry, Error error);

/// What kind of data the bench of this rig file makes; unknown where the file cannot be read.
BenchKind load_bench_kind(const std::filesystem::path& rig);
/// Whether time passes there as in the world; true also where the file cannot be read.
bool runs_in_real_time(const std::filesystem::path& rig);

/// Lets the rig's drivers also come from `settings.folders` and from the folders that the file at
/// `rig_path` names. parse_rig_file alone knows the built-in ones only.
void use_plugins(RigFile& rig, const std::filesystem::path& rig_path, PluginSettings settings);

// The plate's level as `weft align --json` found it, and how a campaign is given it.

/// The rig file `rig_json` with the rotary stages' angles of `align_json` in plate.level, where
/// campaigns read them and data sets keep them. `now_utc` is told, as is `oldest`; zero: of
/// any age, and found by a clock that was ahead of this one.
/// Errors: parse (no JSON, not what weft align says), wrong_state (not levelled, another rig or
/// kind of bench, too old, or of the future), invalid_argument (the rig file has a level already).
Result<std::string> with_level(std::string_view rig_json, std::string_view align_json,
                               std::chrono::nanoseconds now_utc, std::chrono::seconds oldest);

}  // namespace weft::daemon
