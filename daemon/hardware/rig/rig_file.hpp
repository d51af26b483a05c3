#pragma once
// The rig file: the devices of a bench, their links, and the limits of the bench.

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

// The link of a device: the `link` of a rig file's device.

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

/// The port between host and device: the host opens it, weft-rig serves it.
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
  std::string driver;       ///< name of a built-in driver or of a plugin
  std::string config_json;  ///< passed to the driver, see driver_config()
  /// The rig's acceleration limit, for a linear stage [mm/s2].
  std::optional<double> acceleration_mm_s2 = {};
  std::string acceleration_limit;  ///< its pointer in the rig file: "/limits/acceleration_mps2"
  bool noiseless =
      false;  ///< simulated without noise: its identity states so, recipes::lacks_noise()
  std::string emulated_model, emulated_stage;  ///< of its emulator, if the file names them
  LinkSettings link;
  std::vector<LinkSettings> also;        ///< emulated: weft-rig serves the same device there too
  std::optional<LinkSettings> http;      ///< the page of the device's settings, if it has one
  std::optional<LinkSettings> commands;  ///< emulated: weft-rig serves the device's command port
};

/// Opens the page of a device behind a port; null if it has none. Errors: those of the port, at
/// /http.
Result<std::unique_ptr<Link>> open_page(RealLoop& loop, const DeviceEntry& device);

/// The devices behind the links, and the clock.
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
  BenchKind bench = BenchKind::unknown;  ///< of the data: an emulated bench makes simulated data
  Endpoint console;  ///< emulated: where weft-rig accepts orders, `simulation.console` {host, port}
  std::string plant_level;  ///< fidelity level of the plant, "L1"; empty on a real bench
  std::vector<DeviceEntry> devices;
  FixedAxes fixed;                             ///< of the axes without a device
  std::vector<std::filesystem::path> plugins;  ///< folders with drivers, relative to the file
  std::shared_ptr<DriverCatalog> drivers;      ///< source of the devices' drivers
  std::string text;                            ///< the whole file, as recorded with the campaign
};

/// Errors: parse with line and column, and invalid_argument (unknown keys, a link that does not
/// suit the bench) with a JSON pointer.
Result<RigFile> parse_rig_file(std::string_view text);

/// The configuration of a device for its driver. A linear stage with a driver that knows the key
/// `acceleration_mm_s2` gets the rig's limit there. Errors: those of DriverCatalog::source(). Also
/// invalid_argument: the rig file has another value there, but plan, force loop and guards use the
/// limit; or a key needs a link (`x-link` of its schema) that the device does not have.
Result<std::string> driver_config(const DeviceEntry& entry, DriverCatalog& drivers);

/// An error of a driver about its configuration, with its place in the rig file: for a limit that
/// was passed on, the place of the limit.
Error in_rig_file(const DeviceEntry& entry, Error error);

/// The kind of data of this rig file's bench; unknown if the file cannot be read.
BenchKind load_bench_kind(const std::filesystem::path& rig);
/// Whether the bench runs in real time; also true if the file cannot be read.
bool runs_in_real_time(const std::filesystem::path& rig);

/// Adds the drivers from `settings.folders` and from the folders named in the file at `rig_path`.
/// After parse_rig_file() alone only the built-in ones are known.
void use_plugins(RigFile& rig, const std::filesystem::path& rig_path, PluginSettings settings);

// The plate tilt as measured by `weft align --json`, for use in a campaign.

/// The rig file `rig_json` with the rotary stages' angles of `align_json` in plate.level: campaigns
/// read them there, and data sets store them. `oldest`: maximum age at `now_utc`. Zero: any age,
/// and a clock ahead of this one is accepted. Errors: parse (no JSON, no output of weft align),
/// invalid_argument (the rig file already has a level). Also wrong_state: not levelled, another rig
/// or kind of bench, too old, or in the future.
Result<std::string> with_level(std::string_view rig_json, std::string_view align_json,
                               std::chrono::nanoseconds now_utc, std::chrono::seconds oldest);

}  // namespace weft::daemon
