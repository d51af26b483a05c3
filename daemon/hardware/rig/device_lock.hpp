#pragma once
// Device locks: one program at a time has a device, whatever its link, on one computer and across
// all its users.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "daemon/hardware/rig/rig_file.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Locked files in one folder, one per port: the device file of a serial line (links are resolved),
/// or each numeric address of a host with its port. The kernel unlocks them when the process ends.
/// A file names its holder. Not thread-safe.
class DeviceLocks {
 public:
  /// /run/lock if every user may write there, otherwise /tmp: the same for each user.
  static std::filesystem::path default_folder();

  explicit DeviceLocks(std::filesystem::path folder = default_folder())
      : folder_(std::move(folder)) {}
  DeviceLocks(const DeviceLocks&) = delete;
  DeviceLocks& operator=(const DeviceLocks&) = delete;
  ~DeviceLocks();

  /// Locks the ports of a device: its link and its page. A port that these locks already hold is
  /// locked once. Memory links are not locked. `rig` names the rig for other programs. Errors, with
  /// the device's name: busy (names the holder), io (the folder).
  Status acquire(const DeviceEntry& device, const std::string& rig);
  /// acquire() for every device, in the order of the rig file.
  Status acquire(const RigFile& rig);

  /// The descriptors, for a process that must keep the locks after this one has died.
  [[nodiscard]] std::vector<int> descriptors() const;

 private:
  Status lock(const std::string& port, const std::string& rig);

  std::filesystem::path folder_;
  std::map<std::filesystem::path, int> files_;
};

}  // namespace weft::daemon
