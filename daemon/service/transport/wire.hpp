#pragma once
// Addresses on which the daemon listens, and the byte channels of its clients. A port belongs to
// one program; other machines can connect only with TLS.

// clang-format off
#include <cstdint>  // first, so that Asio's choice of allocation is the same in every file
#include <asio/buffer.hpp>
#include <asio/generic/stream_protocol.hpp>
#include <asio/ip/tcp.hpp>
// clang-format on

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "protocols/base/result.hpp"

namespace asio::ssl {
class context;
}

namespace weft::daemon::server {

/// Parses a numeric address. Errors: parse; invalid_argument, if other machines could connect
/// without TLS.
Result<asio::ip::address> address_to_listen_on(const std::string& text, bool with_tls);

/// Listens on `port`, 0 for a free one. Errors: io (another program may use it).
Status listen_on(asio::ip::tcp::acceptor& acceptor, const asio::ip::address& address,
                 std::uint16_t port);

/// "http://127.0.0.1:8080"; with the machine's name if the daemon listens on every address.
std::string http_url(const asio::ip::address& address, std::uint16_t port, bool tls);

/// Addresses for clients with a token: " on 127.0.0.1:7001, http://127.0.0.1:7002". Port 0: none.
std::string format_places(const std::string& listen, std::uint16_t tcp, std::uint16_t http,
                          bool tls);

/// Loads the server's certificate and key for TLS 1.2 and 1.3. PEM files, the chain with the
/// server's own certificate first. Null if neither is named. Errors: invalid_argument (only one is
/// named); not_found; wrong_state (a key that everyone may read); parse (no certificate, no key, or
/// not a pair), with OpenSSL's message.
Result<std::shared_ptr<asio::ssl::context>> load_tls(const std::filesystem::path& certificate,
                                                     const std::filesystem::path& key);

/// Loads both again into `tls`: new connections use them, open ones keep the old ones. Errors:
/// those of load_tls(); then nothing is changed.
Status reload_tls(asio::ssl::context& tls, const std::filesystem::path& certificate,
                  const std::filesystem::path& key);

/// For IPv6 the 64-bit network, because a client chooses its address in it freely. Empty if the
/// client has disconnected.
std::string client_address(const asio::ip::tcp::socket& socket);

/// Byte channel of one client, plain or with TLS; its users need not know which. Thread: one. At
/// most one read and one write may be active at a time.
class Wire {
 public:
  using Done = std::function<void(const asio::error_code& error, std::size_t count)>;
  using Ready = std::function<void(const asio::error_code& error)>;

  virtual ~Wire() = default;
  /// Calls back when bytes may be sent: after the handshake, or immediately without TLS.
  virtual void begin(Ready ready) = 0;
  virtual void read_some(asio::mutable_buffer into, Done done) = 0;
  /// Writes all of `bytes`, which must stay valid until `done`.
  virtual void write(asio::const_buffer bytes, Done done) = 0;
  /// Shuts down the sending side; the peer may still send.
  virtual void end_of_writing() = 0;
  /// One write that does not wait, for use when the server ends.
  virtual void write_at_once(asio::const_buffer bytes) = 0;
  /// Active operations call back with an error.
  virtual void close() = 0;
};

/// Uses TLS if `tls` is not null; it must outlive the wire.
std::unique_ptr<Wire> make_wire(asio::generic::stream_protocol::socket socket,
                                asio::ssl::context* tls);

}  // namespace weft::daemon::server
