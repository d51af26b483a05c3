#pragma once
// One client's bytes, in the clear or through TLS; what is above does not know
// which.

// clang-format off
#include <cstdint>  // first: by its configuration Asio chooses how it allocates, in each file alike
#include <asio/buffer.hpp>
#include <asio/generic/stream_protocol.hpp>
// clang-format on

#include <functional>
#include <memory>

namespace weft::daemon::server {

class TlsServer;

/// Used by one thread. One read and one write may be under way at a time.
class Wire {
 public:
  using Done = std::function<void(const asio::error_code& error, std::size_t count)>;
  using Ready = std::function<void(const asio::error_code& error)>;

  virtual ~Wire() = default;
  /// Calls back once bytes may go: after the handshake, or at once where there
  /// is none.
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
std::unique_ptr<Wire> make_wire(asio::generic::stream_protocol::socket socket, TlsServer* tls);

}  // namespace weft::daemon::server
