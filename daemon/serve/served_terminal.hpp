#pragma once
// A serial device on a pseudo-terminal.

#include <memory>
#include <string>

#include "daemon/link/port_link.hpp"

namespace weft::daemon {

/// Thread-bound to its loop.
class ServedTerminal final : public Link {
 public:
  /// Errors: io.
  static Result<std::unique_ptr<ServedTerminal>> create(RealLoop& loop, const std::string& path);
  ~ServedTerminal() override;

  Status write(ByteView bytes) override { return master_->write(bytes); }
  void on_receive(Receiver receiver) override { master_->on_receive(std::move(receiver)); }
  void on_closed(Closed closed) override { master_->on_closed(std::move(closed)); }

 private:
  ServedTerminal() = default;
  Status publish(const std::string& terminal, const std::string& path);

  std::unique_ptr<Link> master_;
  int slave_ = -1;
  std::string path_;  ///< of the symbolic link, empty until it stands
};

}  // namespace weft::daemon
