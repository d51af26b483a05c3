#pragma once
// JSON-RPC 2.0, one message a line. Source: jsonrpc.org/specification; docs/api.md.

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/service/rpc/rpc_error.hpp"

namespace weft::daemon::rpc {

/// Longest line, its end not counted [bytes].
inline constexpr std::size_t most_line_bytes = std::size_t{1} << 20;
/// A whole line each, of which the daemon asks nothing else: stop motion now.
inline constexpr std::string_view halt_line = "!halt", emergency_line = "!estop";
/// Deepest nesting that is read.
inline constexpr int most_depth = 64;

struct Request {
  std::optional<std::string> id_json;  ///< as it came; absent in a notification
  std::string method;
  std::shared_ptr<const nlohmann::json> params;  ///< always an object
};

/// What came instead of a request, and the id to answer with ("null" where none was readable).
struct Refused {
  std::string id_json;
  RpcError error;
  /// As far as it could be read, where it names a method: a stop is heeded all the same.
  std::optional<Request> received = {};
};

/// One line without its end. Members that JSON-RPC does not know are refused with a did-you-mean:
/// "parmas" would be a call without parameters. Batches are refused: one object a line does what
/// they are for.
tl::expected<Request, Refused> parse_request(std::string_view line);

/// Lines to send, without their end.
std::string result_line(std::string_view id_json, std::string_view result_json);
std::string error_line(std::string_view id_json, const RpcError& error);
std::string notification_line(std::string_view method, std::string_view params_json);

}  // namespace weft::daemon::rpc
