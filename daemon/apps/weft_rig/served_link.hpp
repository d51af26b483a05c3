#pragma once
// The device's end of a link: it waits for a host at the place that the rig file names.

#include <functional>
#include <memory>
#include <vector>

#include "daemon/apps/weft_rig/served_place.hpp"
#include "daemon/apps/weft_rig/served_socket.hpp"
#include "daemon/hardware/rig/rig_file.hpp"
#include "drivers/api/driver.hpp"

namespace weft::daemon {

// A device on a TCP port that serves several hosts at once.

/// How many bytes at the front are whole messages, or no part of any.
using WholeMessages = std::function<std::size_t(ByteView)>;

/// Each host's messages are handed on whole, so that none is mixed with another host's. An answer
/// goes to whom it answers; what a fault has delayed, to who asked last. Unplugged, connections are
/// reset and others refused. Errors: not_found (address), io (port taken).
Result<std::unique_ptr<ServedPlace>> serve_tcp_to_many(RealLoop& loop, const Endpoint& at,
                                                       WholeMessages whole);

/// Serves one device. What is sent while nobody listens is lost, as on a wire. A host may come, go
/// and come again.
///   serial  a pseudo-terminal; `path` becomes a symbolic link to it, removed with the link
///   tcp     listens at host:port; several hosts where `whole` tells their messages apart, else one
///           at a time, the newest wins
///   udp     bound to host:port; answers go to whoever sent the last datagram that redirects them
/// Errors: io, when the place is taken or cannot be made; wrong_state for a link in memory.
Result<std::unique_ptr<ServedPlace>> serve_link(RealLoop& loop, const LinkSettings& settings,
                                                Redirects redirects, WholeMessages whole = {});

/// One device at several places. What it answers goes to whom it answers, what it says unasked to
/// all. There must be at least one.
std::unique_ptr<ServedPlace> join_links(std::vector<std::unique_ptr<ServedPlace>> places);

}  // namespace weft::daemon
