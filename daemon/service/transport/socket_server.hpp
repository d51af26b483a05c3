#pragma once
// Sessions on a Unix socket and on TCP, all on one thread.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "daemon/service/rpc/session.hpp"
#include "daemon/service/transport/wire.hpp"

namespace asio {
class io_context;
}

namespace weft::daemon::server {

struct Limits {
  std::size_t connections = 2048;        ///< of the port; fewer if the process may open fewer files
  std::size_t local_connections = 2048;  ///< of the Unix socket; as above
  /// Additional connections of the Unix socket while all are in use. They may only make urgent
  /// calls (!halt, rig.halt, run.abort) and become regular when one is free. A new one replaces the
  /// oldest.
  std::size_t places_for_stops = 32;
  /// Per listener, connections without session.open: a new one replaces the oldest.
  std::size_t unauthenticated = 64;
  std::size_t line_bytes = rpc::most_line_bytes;
  std::size_t unsent_bytes = std::size_t{4} << 20;  ///< answers that a client does not read
  std::chrono::seconds handshake{5};                ///< of TLS; then it is closed
  std::chrono::seconds introduction{10};  ///< from there to session.open; then it is closed
};

struct Where {
  std::filesystem::path socket;       ///< Unix socket; made with mode 0660
  std::optional<std::uint16_t> port;  ///< TCP; 0 takes a free one
  asio::ip::address address = asio::ip::address_v4::loopback();  ///< of the port
  asio::ssl::context* tls = nullptr;  ///< for TCP; must outlive the server
};

class SocketServer {
 public:
  /// Errors: wrong_state (another daemon listens there), io, invalid_argument (the path exists and
  /// is not a socket, or is a symbolic link: never removed).
  static Result<std::unique_ptr<SocketServer>> open(const Where& where, Shared& shared,
                                                    const Limits& limits);
  ~SocketServer();  ///< removes the socket

  /// Runs until stop(); calls `tick` at least every 20 ms.
  void run(const std::function<void()>& tick);
  /// Thread: any.
  void stop();
  /// Runs `work` on the server's thread. Thread: any.
  void post(std::function<void()> work);
  /// Call after a publish: sends the events.
  void pump();
  /// For other servers on this thread.
  asio::io_context& context();
  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::size_t connections() const;
  /// True if some output to a client is not yet sent.
  [[nodiscard]] bool has_unsent() const;

 private:
  struct Parts;
  explicit SocketServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace weft::daemon::server
