#pragma once
// An emulated rig on real ports in real time, served by weft-rig.

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "daemon/apps/weft_rig/served_link.hpp"
#include "daemon/hardware/rig/rig_file.hpp"
#include "sim/rig/rig.hpp"

namespace weft::daemon {

/// Adds TCP ports to those of the rig file, on 127.0.0.1, numbered from `first` in the file's
/// order. Each device gets one, except Net F/T boxes: their records stay on UDP. Then each Net F/T
/// box gets a port for its pages and one for its commands, unless the file names them.
void serve_on_tcp_too(RigFile& rig, std::uint16_t first);

/// Thread-bound to its loop, which must outlive it.
class RigServer {
 public:
  /// Switches every device on and opens its port; the bare plate lies under the probe. Errors:
  /// those of the rig; a place that cannot be served; wrong_state if the bench is not "emulated".
  static Result<std::unique_ptr<RigServer>> create(RealLoop& loop, const RigFile& rig,
                                                   std::string_view fabrics_json,
                                                   std::uint64_t seed);
  ~RigServer();

  /// A line for each device, pages, command port and the console, with its places.
  [[nodiscard]] std::vector<std::string> lines() const;
  /// Executes one order, a JSON object: {"order": "mount", "fabric", "patch_seed"}, {"order":
  /// "unmount"}, {"order": "truth"}, {"order": "fault", ...} or {"order": "clear", "device",
  /// "fault"}. Returns {"ok": true, ...} or {"ok": false, "error": sentence}.
  std::string execute_order(std::string_view order);

 private:
  RigServer(RealLoop& loop, std::unique_ptr<sim::Rig> rig) : loop_(&loop), rig_(std::move(rig)) {}
  Status serve(const RigFile& rig);
  Status serve(const DeviceEntry& device);
  Status serve_pages(const DeviceEntry& device);
  Status serve_commands(const DeviceEntry& device);
  Status serve_clients(const Endpoint& at, ServedClients::Make make, const std::string& line);
  void apply_plugs();
  void welcome(std::unique_ptr<Link> host);
  void take(std::size_t console, ByteView bytes);

  RealLoop* loop_;
  std::vector<std::string> lines_;
  /// The places and ports of one device.
  struct Served {
    std::string name;
    std::unique_ptr<ServedPlace> place;
    std::vector<std::unique_ptr<ServedClients>> ports;
  };
  std::vector<Served> devices_;
  std::unique_ptr<sim::Rig> rig_;  ///< after devices_: destroyed before the places

  struct Console {
    std::unique_ptr<Link> link;
    std::string line;
  };
  std::map<std::size_t, Console> consoles_;
  std::size_t next_console_ = 0;
  std::unique_ptr<TcpDoor> door_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace weft::daemon
