#include "daemon/server/loopback.hpp"

namespace weft::daemon::server {

using asio::ip::tcp;

Status listen_on_loopback(tcp::acceptor& acceptor, std::uint16_t port) {
  asio::error_code error;
  const tcp::endpoint at(asio::ip::address_v4::loopback(), port);
  acceptor.open(tcp::v4(), error);
  // Address, not port: that one would let a second daemon take half of our clients.
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(at, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error)
    return fail(Errc::io, "cannot listen", "127.0.0.1:" + std::to_string(port), {}, error.message(),
                "Another program may hold the port");
  return {};
}

}  // namespace weft::daemon::server
