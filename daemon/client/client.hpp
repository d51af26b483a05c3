#pragma once
// A program's end of the daemon's socket: one request, one answer, and events in between.

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::daemon::client {

/// Blocking. One thread.
class Client {
 public:
  /// Connects to the Unix socket, hears the greeting and introduces itself.
  /// Errors: not_found (no daemon there), io, timeout, and what the daemon says.
  static Result<Client> open(const std::filesystem::path& socket);

  Client(Client&& other) noexcept;
  Client& operator=(Client&& other) noexcept;
  ~Client();

  /// The result as JSON. The daemon's error keeps its message, place and hint. Events that come
  /// meanwhile are kept for next_event().
  Result<std::string> call(std::string_view method, std::string_view params_json = "{}");
  /// The params of the next event as JSON; waits for it. Errors: io, when the daemon is gone.
  Result<std::string> next_event();
  /// The raw line "!halt".
  Status halt();

 private:
  explicit Client(int descriptor) : descriptor_(descriptor) {}
  Status send_line(std::string_view line);
  Result<std::string> read_line();

  int descriptor_ = -1;
  std::string held_;
  std::deque<std::string> events_;
  std::int64_t next_id_ = 1;
};

}  // namespace weft::daemon::client
