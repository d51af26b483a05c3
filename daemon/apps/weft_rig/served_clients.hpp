#pragma once
// A port of an emulated device that takes many clients: a connection and an emulator for each,
// ended when the client asks.

#include <functional>
#include <map>
#include <memory>

#include "daemon/apps/weft_rig/served_socket.hpp"
#include "sim/devices/emulator.hpp"

namespace weft::daemon {

/// Thread-bound to its loop, which outlives it.
class ServedClients {
 public:
  using Make = std::function<std::unique_ptr<sim::ClientEmulator>()>;
  /// Errors: not_found (address), io (port taken).
  static Result<std::unique_ptr<ServedClients>> open(RealLoop& loop, const Endpoint& at, Make make);
  /// Out: connections end, others are refused. Errors: io, when the port cannot be had again.
  Status set_plugged(bool in);

 private:
  ServedClients(RealLoop& loop, Endpoint at, Make make)
      : loop_(&loop), at_(std::move(at)), make_(std::move(make)) {}
  void welcome(std::unique_ptr<Link> host);
  void answer(std::size_t client, ByteView bytes, TimePoint at);
  void end_soon(std::size_t client);

  struct Client {
    std::unique_ptr<Link> link;
    std::unique_ptr<sim::ClientEmulator> emulator;
  };
  RealLoop* loop_;
  Endpoint at_;
  Make make_;
  std::map<std::size_t, Client> clients_;
  std::size_t next_client_ = 0;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  std::unique_ptr<TcpDoor> door_;
};

}  // namespace weft::daemon
