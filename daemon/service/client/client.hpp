#pragma once
// A program's end of the daemon's socket: one request, one answer, and events in between.

#include <cstdint>
#include <deque>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "daemon/service/rpc/message.hpp"

namespace weft::daemon::client {

/// Where a daemon is, and what to show and to ask of it.
struct Where {
  std::string at;  ///< a Unix socket's path, "tls://HOST:PORT" or "tcp://127.0.0.1:PORT"
  /// Certificates that are trusted (PEM); empty: the system's.
  std::filesystem::path tls_ca = {};
  std::string token = {};  ///< "wft_...": not needed on a Unix socket
};

/// How a program's bytes get to a daemon and back: a Unix socket, TCP on this machine, or TLS.
/// Blocking. One thread.
class Channel {
 public:
  virtual ~Channel() = default;
  /// All of it. Errors: io.
  virtual Status send(std::string_view bytes) = 0;
  /// What has come, waited for; 0 where the other end has closed. Errors: io.
  virtual Result<std::size_t> receive(std::span<char> into) = 0;
};

/// Blocking. One thread.
class Client {
 public:
  /// Connects, hears the greeting and introduces itself. Errors: not_found (nobody answers there),
  /// parse (no such address), wrong_state (a certificate that is not believed, or of another host),
  /// timeout, tcp:// to another machine, which would show the token to everybody; io, and what the
  /// daemon says.
  static Result<Client> open(const Where& where);
  static Result<Client> open(const std::filesystem::path& socket);

  /// The result as JSON. The daemon's error keeps its message, place and hint.
  /// Events that come meanwhile are kept for next_event().
  Result<std::string> call(std::string_view method, std::string_view params_json = "{}");
  /// The kind of the daemon's newest error, "token.name_taken"; empty before the first.
  [[nodiscard]] const std::string& refusal() const { return refusal_; }
  /// The params of the next event as JSON; waits for it. Errors: io, when the daemon is gone; what
  /// it says before it closes the connection.
  Result<std::string> next_event();
  /// Sends the raw line "!halt", or "!estop", to a Unix socket, without a session; waits until the
  /// daemon has taken it. Errors: as open(), but for those of a session.
  static Status halt(const std::filesystem::path& socket, bool emergency);

 private:
  explicit Client(std::unique_ptr<Channel> channel) : channel_(std::move(channel)) {}
  Status send_line(std::string_view line);
  Result<std::string> read_line();

  std::unique_ptr<Channel> channel_;
  rpc::LineBuffer lines_{std::numeric_limits<std::size_t>::max()};
  std::deque<std::string> events_;
  std::string refusal_;
  std::int64_t next_id_ = 1;
};

}  // namespace weft::daemon::client
