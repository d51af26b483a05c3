#pragma once
// A serial device on a pseudo-terminal.

#include <memory>
#include <string>

#include "daemon/apps/weft_rig/served_link.hpp"
#include "daemon/hardware/link/descriptor_link.hpp"

namespace weft::daemon {

/// Thread-bound to its loop, which must outlive it. Unplugged, the terminal hangs up and its path
/// is removed, as with a serial adapter. Plugged in again, another terminal is at the same path.
///
/// As on a serial port, bytes that the device sends while no host has the terminal open are lost.
/// Bytes that the last host left unread are lost too; line settings stay. Made by plugged_in():
/// there is no terminal before set_plugged(true) (errors: io). A host that opens a vacant terminal
/// is a new host. A host that does not read gets the bytes that the system buffers, about 20 kB, in
/// whole messages.
class ServedTerminal final : public ServedPlace {
 public:
  ServedTerminal(RealLoop& loop, std::string path) : loop_(&loop), path_(std::move(path)) {}
  ~ServedTerminal() override;

  Status write(ByteView bytes) override;
  void on_receive(Receiver receiver) override { receiver_ = std::move(receiver); }
  void on_closed(Closed) override {}  // a device outlives its hosts
  [[nodiscard]] bool has_host() const override { return occupied_; }
  void on_host_came(HostCame came) override { came_ = std::move(came); }
  Status set_plugged(bool in) override;

 private:
  Status plug_in();
  void pull();
  Status publish();
  [[nodiscard]] int open_other_end() const;
  void have_host();
  void have_lost_host();
  void poll_host();

  RealLoop* loop_;
  std::string path_;  ///< of the symbolic link
  Receiver receiver_;
  HostCame came_;
  std::unique_ptr<DescriptorLink> master_;
  int master_port_ = -1;  ///< owned by master_
  std::string terminal_;
  bool occupied_ = false;  ///< a host has the terminal open
  bool looking_ = false;
  bool published_ = false;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace weft::daemon
