#include "daemon/service/transport/loopback.hpp"

#include <asio/ip/host_name.hpp>

namespace weft::daemon::server {

using asio::ip::tcp;

Result<asio::ip::address> address_to_listen_on(const std::string& text, bool with_tls) {
  asio::error_code error;
  const asio::ip::address address = asio::ip::make_address(text, error);
  if (error)
    return fail({.code = Errc::parse,
                 .where = "--listen",
                 .what = "not an address",
                 .expected = "127.0.0.1, ::1 or one of this machine",
                 .got = text});
  if (address.is_loopback() || with_tls) return address;
  return fail({.code = Errc::invalid_argument,
               .where = "--listen",
               .what = "an address that other machines reach is refused without TLS",
               .expected = "127.0.0.1, or --tls-cert and --tls-key",
               .got = text,
               .hint = "Tokens would go over the network for everybody to read"});
}

Status listen_on(tcp::acceptor& acceptor, const asio::ip::address& address, std::uint16_t port) {
  asio::error_code error;
  const tcp::endpoint at(address, port);
  acceptor.open(at.protocol(), error);
  // Address, not port: that one would let a second daemon take half of our
  // clients.
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(at, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error)
    return fail({.code = Errc::io,
                 .where = address.to_string() + ":" + std::to_string(port),
                 .what = "cannot listen",
                 .got = error.message(),
                 .hint = "Another program may hold the port"});
  return {};
}

std::string http_url(const asio::ip::address& address, std::uint16_t port, bool tls) {
  std::string host = address.is_v6() ? "[" + address.to_string() + "]" : address.to_string();
  asio::error_code nameless;
  if (address.is_unspecified())  // it listens everywhere, and that is nobody's address
    if (const std::string name = asio::ip::host_name(nameless); !nameless) host = name;
  return (tls ? "https://" : "http://") + host + ":" + std::to_string(port);
}

}  // namespace weft::daemon::server
