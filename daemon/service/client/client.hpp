#pragma once
// Client side of the daemon's socket: sends requests, receives answers and the events in between.

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

/// Address of a daemon, and the credentials for it.
struct Where {
  std::string at;  ///< path of a Unix socket, "tls://HOST:PORT" or "tcp://127.0.0.1:PORT"
  /// CA certificates to trust (PEM); empty: the system's.
  std::filesystem::path tls_ca = {};
  std::string token = {};  ///< "wft_..."; not needed on a Unix socket
};

/// Byte channel to a daemon: a Unix socket, TCP on this machine, or TLS. Blocking. Thread: one.
class Channel {
 public:
  virtual ~Channel() = default;
  /// Sends all bytes. Errors: io.
  virtual Status send(std::string_view bytes) = 0;
  /// Waits for bytes and returns their number; 0 if the other end has closed. Errors: io.
  virtual Result<std::size_t> receive(std::span<char> into) = 0;
};

/// Blocking. Thread: one.
class Client {
 public:
  /// Connects, reads the greeting and opens a session. Errors: not_found (no daemon listens there),
  /// parse (invalid address), wrong_state (certificate not trusted, or of another host), timeout,
  /// io, and the daemon's own errors. tcp:// to another machine is refused, because it would expose
  /// the token.
  static Result<Client> open(const Where& where);
  static Result<Client> open(const std::filesystem::path& socket);

  /// Returns the result as JSON. The daemon's error keeps its message, place and hint. Events that
  /// arrive meanwhile are kept for next_event().
  Result<std::string> call(std::string_view method, std::string_view params_json = "{}");
  /// Kind of the daemon's newest error, such as "token.name_taken"; empty before the first.
  [[nodiscard]] const std::string& refusal() const { return refusal_; }
  /// Waits for the next event and returns its params as JSON. Errors: io, when the daemon is gone;
  /// the error that the daemon sends before it closes the connection.
  Result<std::string> next_event();
  /// Sends the raw line "!halt" or "!estop" to a Unix socket, without a session. Waits until the
  /// daemon has processed it. Errors: as open(), except those of a session.
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
