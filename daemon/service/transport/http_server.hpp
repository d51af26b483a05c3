#pragma once
// The same objects over HTTP, for curl and browsers: POST /rpc answers one
// request, GET /events streams events (server-sent events), GET /data/RUN/FILE
// sends a file, GET / a page that uses all three. Every request but for the page brings its token
// as a bearer. All on the daemon's thread, so that no client can wait for another. Source:
// docs/api.md.

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
  /// Whose request is not whole or whose answer is under way; the oldest makes room for a new one.
  std::size_t brief = 64;
  std::size_t waiting = 16;                   ///< calls whose answers come later
  std::size_t streams = 32;                   ///< of events; each page that is open has one
  std::size_t files = 8;                      ///< on their way to clients
  std::chrono::seconds request{10};           ///< from connecting to the request's last byte
  std::chrono::seconds answer{600};           ///< for methods that wait
  std::chrono::seconds unread{5};             ///< of a client that does not read
  std::chrono::milliseconds heartbeat{5000};  ///< a comment where there is no event
};

class HttpServer {
 public:
  /// Where it listens. Under TLS the certificate says whose names are meant,
  /// and any Host is heard.
  struct At {
    std::uint16_t port = 0;  ///< 0 takes a free one
    asio::ip::address address = asio::ip::address_v4::loopback();
    asio::ssl::context* tls = nullptr;  ///< outlives the server
  };
  /// Serves while `context` runs, which outlives it, on that thread. Errors:
  /// io.
  static Result<std::unique_ptr<HttpServer>> open(asio::io_context& context, const At& at,
                                                  Shared& shared, const HttpLimits& limits);
  /// Ends what is under way; calls that wait are told. Only when `context` does not run any more.
  ~HttpServer();

  /// Something was published, or time has passed.
  void pump();
  [[nodiscard]] std::uint16_t port() const;

 private:
  struct Parts;
  explicit HttpServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace weft::daemon::server
