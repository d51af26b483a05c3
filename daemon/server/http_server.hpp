#pragma once
// The same objects over HTTP, for curl and browsers: POST /rpc answers one request, GET /events
// streams events (server-sent events). On 127.0.0.1; every request brings its token as a bearer.
// Source: design/API.md, 2.1; https://html.spec.whatwg.org, "Server-sent events".

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>

#include "daemon/server/conversation.hpp"

namespace weft::daemon::server {

struct HttpLimits {
  std::size_t requests = 16;                  ///< at a time, streams of events among them
  std::size_t streams = 8;                    ///< of events at a time
  std::chrono::seconds silence{5};            ///< of a client that is sending a request
  std::chrono::seconds answer{600};           ///< for methods that wait
  std::chrono::milliseconds heartbeat{5000};  ///< a comment where there is no event
};

class HttpServer {
 public:
  /// `post` runs work on the daemon's thread, where all conversations are. Errors: io.
  static Result<std::unique_ptr<HttpServer>> open(std::uint16_t port, Shared& shared,
                                                  std::function<void(std::function<void()>)> post,
                                                  const HttpLimits& limits);
  /// Ends what is under way.
  ~HttpServer();

  /// Something was published, or time has passed: on the daemon's thread.
  void pump();
  [[nodiscard]] std::uint16_t port() const;

 private:
  struct Parts;
  explicit HttpServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace weft::daemon::server
