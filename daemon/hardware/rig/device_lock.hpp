#pragma once
// Device locks: one program at a time has a device, whatever its link, on one machine and for all
// its users.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "daemon/hardware/rig/rig_file.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Locked files in one folder, one for each port: the device file of a serial line (a link to it
/// counts as the file), each numeric address of a host with its port. The kernel unlocks them when
/// the process ends. A file names its holder. Not thread-safe.
class DeviceLocks {
 public:
  /// /run/lock where every user may write there, else /tmp: the same for each of them.
  static std::filesystem::path default_folder();

  explicit DeviceLocks(std::filesystem::path folder = default_folder())
      : folder_(std::move(folder)) {}
  DeviceLocks(const DeviceLocks&) = delete;
  DeviceLocks& operator=(const DeviceLocks&) = delete;
  ~DeviceLocks();

  /// Locks the ports of a device: its link and its page; a port that these locks have already is
  /// locked once. Nothing in memory is locked. `rig` names the rig for others who ask.
  /// Errors, with the device's name: busy (names the holder), io (the folder).
  Status acquire(const DeviceEntry& device, const std::string& rig);
  /// acquire() of every device, in the order of the rig file.
  Status acquire(const RigFile& rig);

  /// The descriptors, for a process that has to keep the locks when this one has died.
  [[nodiscard]] std::vector<int> descriptors() const;

 private:
  Status lock(const std::string& port, const std::string& rig);

  std::filesystem::path folder_;
  std::map<std::filesystem::path, int> files_;
};

}  // namespace weft::daemon
