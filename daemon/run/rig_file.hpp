#pragma once
// The rig file: which devices a bench has, how they are reached, and what the bench allows.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

struct DeviceEntry {
  std::string name;         ///< "stage.z"
  std::string role;         ///< "x", "y", "z", "rx", "ry", "wrench", "taxels"
  std::string driver;       ///< name of a driver plugin
  std::string config_json;  ///< handed to the driver as it stands
};

/// The part of a rig file that wires devices. Limits are read by recipes::parse_rig_limits, the
/// emulators' part by sim::Rig::create, from the same text. Every link is in memory.
struct RigFile {
  std::string name;
  BenchKind bench = BenchKind::unknown;
  std::string plant_level;  ///< fidelity of the plant, "L1"; empty on a real bench
  std::vector<DeviceEntry> devices;
  std::string text;  ///< the whole file, as recorded with the campaign
};

/// Errors: parse with line and column, invalid_argument (unknown keys too) and unsupported (a bench
/// or link that this version cannot run) with a JSON pointer.
Result<RigFile> parse_rig_file(std::string_view text);

/// A whole text file. Errors: not_found, io, range when it is larger than `max_bytes`: recipes and
/// rigs are small, so a huge file is refused before it is read.
Result<std::string> read_text_file(const std::filesystem::path& path,
                                   std::uintmax_t max_bytes = 1 << 20);

}  // namespace weft::daemon
