#pragma once
// Conversations on a Unix socket and on TCP, all on one thread.

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
  std::size_t connections = 2048;        ///< of the port; fewer where fewer files may be open
  std::size_t local_connections = 2048;  ///< of the Unix socket; likewise
  /// Beside these of the Unix socket, while all are taken: they may say what is urgent (!halt,
  /// rig.halt, run.abort) and get a place when one is free. The oldest makes room for one more.
  std::size_t places_for_stops = 32;
  /// Of either, that have not introduced themselves: the oldest makes room for one more.
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
  asio::ssl::context* tls = nullptr;                             ///< for TCP; outlives the server
};

class SocketServer {
 public:
  /// Errors: wrong_state (another daemon listens there), io, invalid_argument (not a socket, or a
  /// symbolic link, in the way: never removed).
  static Result<std::unique_ptr<SocketServer>> open(const Where& where, Shared& shared,
                                                    const Limits& limits);
  ~SocketServer();  ///< removes the socket

  /// Runs until stop(); calls `tick` at least every 20 ms.
  void run(const std::function<void()>& tick);
  /// From any thread.
  void stop();
  /// Runs `work` on the server's thread; from any.
  void post(std::function<void()> work);
  /// Something was published: send it.
  void pump();
  /// Where other servers of this thread may wait for their clients.
  asio::io_context& context();
  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::size_t connections() const;
  /// Whether anything that was said to a client has not left yet.
  [[nodiscard]] bool has_unsent() const;

 private:
  struct Parts;
  explicit SocketServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace weft::daemon::server
