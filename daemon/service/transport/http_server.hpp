#pragma once
// The API over HTTP, for curl and browsers. POST /rpc answers one request, GET /events streams
// events (server-sent events), GET /data/RUN/FILE sends a file, GET / the page that uses all three.
// Every request except for the page has its token as a bearer. Thread: the daemon's, so no
// operation may block. Source: docs/reference/api.md.

#include <chrono>
#include <cstdint>
#include <memory>

#include "daemon/service/rpc/session.hpp"
#include "daemon/service/transport/wire.hpp"

namespace asio {
class io_context;
}

namespace weft::daemon::server {

struct HttpLimits {
  /// Connections with an incomplete request or an answer being sent; a new one replaces the oldest.
  std::size_t brief = 64;
  std::size_t waiting = 16;                   ///< calls with a later answer
  std::size_t streams = 32;                   ///< of events; each open page has one
  std::size_t files = 8;                      ///< being sent to clients
  std::chrono::seconds request{10};           ///< from connecting to the request's last byte
  std::chrono::seconds answer{600};           ///< for methods that wait
  std::chrono::seconds unread{5};             ///< for a client that does not read
  std::chrono::milliseconds heartbeat{5000};  ///< period of comments while there is no event
};

class HttpServer {
 public:
  /// Where to listen. Under TLS the certificate identifies the server, so any Host is accepted.
  struct At {
    std::uint16_t port = 0;  ///< 0: a free port
    asio::ip::address address = asio::ip::address_v4::loopback();
    asio::ssl::context* tls = nullptr;  ///< must outlive the server
  };
  /// Serves while `context` runs, on its thread; `context` must outlive the server. Errors: io.
  static Result<std::unique_ptr<HttpServer>> open(asio::io_context& context, const At& at,
                                                  Shared& shared, const HttpLimits& limits);
  /// Closes all connections; waiting calls get an answer. Only when `context` no longer runs.
  ~HttpServer();

  /// Call after a publish or when time has passed.
  void pump();
  [[nodiscard]] std::uint16_t port() const;

 private:
  struct Parts;
  explicit HttpServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace weft::daemon::server
