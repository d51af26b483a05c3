#pragma once
// A TCP port on 127.0.0.1, one program's alone.

// clang-format off
#include <cstdint>  // first: by its configuration Asio chooses how it allocates, in each file alike
#include <asio/ip/tcp.hpp>
// clang-format on

#include "protocols/base/result.hpp"

namespace weft::daemon::server {

/// Listens on `port`, 0 for a free one. Errors: io (another program may hold it).
Status listen_on_loopback(asio::ip::tcp::acceptor& acceptor, std::uint16_t port);

}  // namespace weft::daemon::server
