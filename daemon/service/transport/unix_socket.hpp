#pragma once
// The daemon's own end of its Unix socket: where it listens, and who has come.

#include <asio/local/stream_protocol.hpp>
#include <filesystem>

#include "daemon/service/rpc/session.hpp"

namespace weft::daemon::server {

/// Listens at `path`, mode 0660. Removes the socket of a daemon that died; whatever else is in the
/// way stays. Errors: wrong_state (another daemon listens there), io, range (a path too long),
/// invalid_argument (not a socket, or a symbolic link, in the way).
Status open_unix(asio::local::stream_protocol::acceptor& acceptor,
                 const std::filesystem::path& path);

/// Who may open the socket was settled by its mode: the daemon's own user and root administer it,
/// its group runs recipes.
Peer read_peer(int descriptor);

}  // namespace weft::daemon::server
