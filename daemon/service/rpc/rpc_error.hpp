#pragma once
// What a client is told when a request fails. The contract is the string `kind`; the number is
// JSON-RPC's own or of the block it belongs to. Source: docs/api.md, Errors.

#include <string>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::daemon::rpc {

namespace code {
// JSON-RPC 2.0, section 5.1
inline constexpr int parse_error = -32700;
inline constexpr int invalid_request = -32600;
inline constexpr int method_not_found = -32601;
inline constexpr int invalid_params = -32602;
// blocks of our own: 1000 request, 2000 access, 3000 state, 4000 device, 5000 safety, 6000 storage,
// 7000 internal
inline constexpr int request = 1000;
inline constexpr int access = 2000;
inline constexpr int state = 3000;
inline constexpr int device = 4000;
inline constexpr int safety = 5000;
inline constexpr int storage = 6000;
inline constexpr int internal = 7000;
}  // namespace code

struct RpcError {
  int code = code::internal;
  std::string kind;  ///< "param.unknown"; stable within a major version of the protocol
  Error error;
  bool retryable = false;
  std::string blockers_json;  ///< array of {kind, where, hint}; empty where none belongs
};

/// Number and kind from the error's own code.
RpcError from(const Error& error);
/// An error of this block: `code` is one of code::.
RpcError rpc_error(int code, std::string_view kind, Error error, bool retryable = false);

/// The value of "error" in a response, on one line.
std::string to_json(const RpcError& error);
/// What to_json() made, back again; an internal error where it is something else.
RpcError error_from_json(std::string_view text);

}  // namespace weft::daemon::rpc
