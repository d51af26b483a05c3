#pragma once
// Where a daemon listens, and the bytes of those who connect: one program's port alone, and beyond
// this machine only under TLS.

// clang-format off
#include <cstdint>  // first: by its configuration Asio chooses how it allocates, in each file alike
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

/// A numeric address. Errors: parse; invalid_argument, where others than this machine could connect
/// and there is no TLS.
Result<asio::ip::address> address_to_listen_on(const std::string& text, bool with_tls);

/// Listens on `port`, 0 for a free one. Errors: io (another program may hold it).
Status listen_on(asio::ip::tcp::acceptor& acceptor, const asio::ip::address& address,
                 std::uint16_t port);

/// "http://127.0.0.1:8080"; with the machine's name where the daemon listens on every address.
std::string http_url(const asio::ip::address& address, std::uint16_t port, bool tls);

/// Where clients with a token connect: " on 127.0.0.1:7001, http://127.0.0.1:7002". Ports: 0 for
/// none.
std::string format_places(const std::string& listen, std::uint16_t tcp, std::uint16_t http,
                          bool tls);

/// What a server shows of itself under TLS 1.2 and 1.3: its certificate, and that it has the key.
/// PEM files, the chain with the server's own certificate first. Null where neither is named.
/// Errors: invalid_argument (one of them alone); not_found; wrong_state (a key that all may read);
/// parse (no certificate, no key, or not of one pair), with OpenSSL's words.
Result<std::shared_ptr<asio::ssl::context>> load_tls(const std::filesystem::path& certificate,
                                                     const std::filesystem::path& key);

/// Loads them anew into `tls`: new connections use them, those that are open keep the old ones.
/// Errors: load_tls()'s; nothing is changed then.
Status reload_tls(asio::ssl::context& tls, const std::filesystem::path& certificate,
                  const std::filesystem::path& key);

/// Of an IPv6 address its network of 64 bits, in which a client chooses its address freely; empty
/// where the client has gone.
std::string client_address(const asio::ip::tcp::socket& socket);

/// One client's bytes, in the clear or through TLS; what is above does not know which. Used by one
/// thread. One read and one write may be under way at a time.
class Wire {
 public:
  using Done = std::function<void(const asio::error_code& error, std::size_t count)>;
  using Ready = std::function<void(const asio::error_code& error)>;

  virtual ~Wire() = default;
  /// Calls back once bytes may go: after the handshake, or at once where there is none.
  virtual void begin(Ready ready) = 0;
  virtual void read_some(asio::mutable_buffer into, Done done) = 0;
  /// All of `bytes`, which stay valid until then.
  virtual void write(asio::const_buffer bytes, Done done) = 0;
  /// No more will be written: the peer is told, and may still send.
  virtual void end_of_writing() = 0;
  /// One try without waiting, in place of a word that nobody could wait for.
  virtual void write_at_once(asio::const_buffer bytes) = 0;
  /// What is under way is called back with an error.
  virtual void close() = 0;
};

/// Through TLS where there is a `tls`, which outlives it.
std::unique_ptr<Wire> make_wire(asio::generic::stream_protocol::socket socket,
                                asio::ssl::context* tls);

}  // namespace weft::daemon::server
