#pragma once
// A device on a TCP port that serves several hosts at once.

#include <functional>
#include <memory>

#include "daemon/apps/weft_rig/served_socket.hpp"

namespace weft::daemon {

/// How many bytes at the front are whole messages, or no part of any.
using WholeMessages = std::function<std::size_t(ByteView)>;

/// Each host's messages are handed on whole, so that none is mixed with another host's. An answer
/// goes to whom it answers; what a fault has delayed, to who asked last. Unplugged, connections are
/// reset and others refused. Errors: not_found (address), io (port taken).
Result<std::unique_ptr<ServedPlace>> serve_tcp_to_many(RealLoop& loop, const Endpoint& at,
                                                       WholeMessages whole);

}  // namespace weft::daemon
