#pragma once
// A program's end of the daemon's socket: one request, one answer, and events in between.

#include <cstdint>
#include <deque>
#include <filesystem>
#include <string>
#include <string_view>

#include "daemon/service/client/channel.hpp"

namespace weft::daemon::client {

/// Blocking. One thread.
class Client {
 public:
  /// Connects, hears the greeting and introduces itself.
  /// Errors: open_channel()'s, io, and what the daemon says.
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
  /// The raw line "!halt", or "!estop".
  Status halt(bool emergency = false);

 private:
  explicit Client(std::unique_ptr<Channel> channel) : channel_(std::move(channel)) {}
  Status send_line(std::string_view line);
  Result<std::string> read_line();

  std::unique_ptr<Channel> channel_;
  std::string held_;
  std::deque<std::string> events_;
  std::string refusal_;
  std::int64_t next_id_ = 1;
};

}  // namespace weft::daemon::client
