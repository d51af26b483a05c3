#pragma once
// Where a daemon listens: one program's port alone, and beyond this machine
// only under TLS.

// clang-format off
#include <cstdint>  // first: by its configuration Asio chooses how it allocates, in each file alike
#include <asio/ip/tcp.hpp>
// clang-format on

#include <string>

#include "protocols/base/result.hpp"

namespace weft::daemon::server {

/// A numeric address. Errors: parse; invalid_argument, where others than this
/// machine could connect and there is no TLS.
Result<asio::ip::address> address_to_listen_on(const std::string& text, bool with_tls);

/// Listens on `port`, 0 for a free one. Errors: io (another program may hold
/// it).
Status listen_on(asio::ip::tcp::acceptor& acceptor, const asio::ip::address& address,
                 std::uint16_t port);

/// "http://127.0.0.1:8080"; with the machine's name where the daemon listens on every address.
std::string http_url(const asio::ip::address& address, std::uint16_t port, bool tls);

}  // namespace weft::daemon::server
