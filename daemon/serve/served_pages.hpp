#pragma once
// The HTTP port of an emulated device: a connection for each client, ended when the client asks.

#include <functional>
#include <map>
#include <memory>

#include "daemon/serve/served_socket.hpp"
#include "sim/devices/netft_page_emulator.hpp"

namespace weft::daemon {

/// Thread-bound to its loop, which outlives it.
class ServedPages {
 public:
  using MakePage = std::function<std::unique_ptr<sim::NetftPageEmulator>()>;
  /// Errors: not_found (address), io (port taken).
  static Result<std::unique_ptr<ServedPages>> open(RealLoop& loop, const Endpoint& at,
                                                   MakePage make);

 private:
  ServedPages(RealLoop& loop, MakePage make) : loop_(&loop), make_(std::move(make)) {}
  void welcome(std::unique_ptr<Link> host);
  void answer(std::size_t client, ByteView bytes, TimePoint at);
  void end_soon(std::size_t client);

  struct Client {
    std::unique_ptr<Link> link;
    std::unique_ptr<sim::NetftPageEmulator> page;
  };
  RealLoop* loop_;
  MakePage make_;
  std::map<std::size_t, Client> clients_;
  std::size_t next_client_ = 0;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  std::unique_ptr<TcpDoor> door_;
};

}  // namespace weft::daemon
