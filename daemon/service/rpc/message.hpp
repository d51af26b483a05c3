#pragma once
// JSON-RPC 2.0, one message per line: bytes to lines (LineBuffer), lines to requests, answers to
// lines, errors, and suggestions for a misspelt word. Source: jsonrpc.org/specification;
// docs/reference/api.md.

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::daemon::rpc {

namespace code {
// JSON-RPC 2.0, section 5.1
inline constexpr int parse_error = -32700;
inline constexpr int invalid_request = -32600;
inline constexpr int method_not_found = -32601;
inline constexpr int invalid_params = -32602;
// Weft's blocks: 1000 request, 2000 access, 3000 state, 4000 device, 5000 safety, 6000 storage,
// 7000 internal
inline constexpr int request = 1000;
inline constexpr int access = 2000;
inline constexpr int state = 3000;
inline constexpr int internal = 7000;
}  // namespace code

/// Error sent to a client. Clients rely on the string `kind`; the number is JSON-RPC's own or that
/// of its block. Source: docs/reference/api.md, Errors.
struct RpcError {
  int code = code::internal;
  std::string kind;  ///< "param.unknown"; stable within a major version of the protocol
  Error error;
  bool retryable = false;
};

/// Takes number and kind from the error's own code.
RpcError from(const Error& error);
tl::unexpected<RpcError> refused(const Error& error);
/// An error of a block: `code` is one of code::.
RpcError rpc_error(int code, std::string_view kind, Error error, bool retryable = false);
tl::unexpected<RpcError> refused(int code, std::string_view kind, Error error,
                                 bool retryable = false);

/// The value of "error" in a response, on one line.
std::string to_json(const RpcError& error);
/// Inverse of to_json(); an internal error for any other text.
RpcError error_from_json(std::string_view text);
/// JSON on one line; invalid UTF-8 is replaced.
std::string format_text(const nlohmann::json& value);

/// Longest line, without its line end [bytes].
inline constexpr std::size_t most_line_bytes = std::size_t{1} << 20;
/// Raw lines that stop all motion now; each is a whole line without JSON.
inline constexpr std::string_view halt_line = "!halt", emergency_line = "!estop";
/// Deepest nesting that is accepted.
inline constexpr std::size_t most_depth = 64;

struct Request {
  std::optional<std::string> id_json;  ///< JSON as received; absent in a notification
  std::string method;
  std::shared_ptr<const nlohmann::json> params;  ///< always an object
};

/// A line that is not a valid request, and the id for the error ("null" if unreadable).
struct Refused {
  std::string id_json;
  RpcError error;
  /// The request as far as readable, if it names a method: a stop is executed all the same.
  std::optional<Request> received = {};
};

/// Parses one line without its end. Unknown members are refused with a suggestion, because "parmas"
/// would be a call without parameters. Batches are refused: one object per line serves the same
/// purpose.
tl::expected<Request, Refused> parse_request(std::string_view line);

/// Lines to send, without their line end.
std::string result_line(std::string_view id_json, std::string_view result_json);
std::string error_line(std::string_view id_json, const RpcError& error);
std::string notification_line(std::string_view method, std::string_view params_json);

/// Splits bytes into lines, bounded: the caller closes the connection when it overflows.
class LineBuffer {
 public:
  explicit LineBuffer(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  void add(std::string_view bytes) { held_.append(bytes); }
  /// The next whole line without its end ("\n" or "\r\n").
  std::optional<std::string> next() {
    const std::size_t end = held_.find('\n', searched_);
    if (end == std::string::npos) {
      searched_ = held_.size();
      return std::nullopt;
    }
    std::string line = held_.substr(0, end);
    held_.erase(0, end + 1);
    searched_ = 0;
    if (line.ends_with('\r')) line.pop_back();
    return line;
  }
  /// The bytes after the last whole line, once next() is empty.
  [[nodiscard]] std::string_view rest() const { return held_; }
  /// More bytes are buffered than one line may have.
  [[nodiscard]] bool overflows() const { return held_.size() > most_bytes_; }

 private:
  std::string held_;
  std::size_t searched_ = 0;  // no line end before this index
  std::size_t most_bytes_;
};

}  // namespace weft::daemon::rpc
