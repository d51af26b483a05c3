#pragma once
// A serial device on a pseudo-terminal.

#include <memory>
#include <string>

#include "daemon/link/port_link.hpp"
#include "daemon/serve/served_place.hpp"

namespace weft::daemon {

/// Thread-bound to its loop, which outlives it. Unplugged, the terminal hangs up and its path is
/// gone, as with a serial adapter; plugged in again, another terminal is at the same path.
class ServedTerminal final : public ServedPlace {
 public:
  /// Errors: io.
  static Result<std::unique_ptr<ServedTerminal>> create(RealLoop& loop, const std::string& path);
  ~ServedTerminal() override;

  // Without a plug: lost, as on a wire.
  Status write(ByteView bytes) override { return master_ ? master_->write(bytes) : Status{}; }
  void on_receive(Receiver receiver) override { receiver_ = std::move(receiver); }
  void on_closed(Closed) override {}  // a device outlives its hosts
  Status set_plugged(bool in) override;

 private:
  ServedTerminal(RealLoop& loop, std::string path) : loop_(&loop), path_(std::move(path)) {}
  Status plug_in();
  void pull();
  Status publish(const std::string& terminal);

  RealLoop* loop_;
  std::string path_;  ///< of the symbolic link
  Receiver receiver_;
  std::unique_ptr<Link> master_;
  int slave_ = -1;
  bool published_ = false;
};

}  // namespace weft::daemon
