#include "daemon/service/transport/wire.hpp"

#include <asio/ssl.hpp>
#include <asio/write.hpp>

#include "daemon/service/transport/tls_server.hpp"

namespace weft::daemon::server {
namespace {

using Socket = asio::generic::stream_protocol::socket;

class PlainWire final : public Wire {
 public:
  explicit PlainWire(Socket socket) : socket_(std::move(socket)) {}

  void begin(Ready ready) override { ready({}); }
  void read_some(asio::mutable_buffer into, Done done) override {
    socket_.async_read_some(into, std::move(done));
  }
  void write(asio::const_buffer bytes, Done done) override {
    asio::async_write(socket_, bytes, std::move(done));
  }
  void end_of_writing() override {
    asio::error_code ignored;
    socket_.shutdown(Socket::shutdown_send, ignored);
  }
  void write_at_once(asio::const_buffer bytes) override {
    asio::error_code ignored;
    socket_.non_blocking(true, ignored);
    socket_.write_some(bytes, ignored);
  }
  void close() override {
    asio::error_code ignored;
    socket_.shutdown(Socket::shutdown_both, ignored);  // the client hears it whoever has a copy
    socket_.close(ignored);
  }

 private:
  Socket socket_;
};

class TlsWire final : public Wire {
 public:
  TlsWire(Socket socket, asio::ssl::context& context)
      : stream_(std::make_shared<Stream>(std::move(socket), context)) {}

  void begin(Ready ready) override {
    stream_->async_handshake(Stream::server, [stream = stream_, ready = std::move(ready)](
                                                 const asio::error_code& e) { ready(e); });
  }
  void read_some(asio::mutable_buffer into, Done done) override {
    stream_->async_read_some(into, std::move(done));
  }
  void write(asio::const_buffer bytes, Done done) override {
    asio::async_write(*stream_, bytes, std::move(done));
  }
  // Its answer is not waited for: whoever has read all closes, or is closed.
  void end_of_writing() override {
    stream_->async_shutdown([stream = stream_](const asio::error_code&) {});
  }
  // A record between records of another operation would be garbage to the peer.
  void write_at_once(asio::const_buffer) override {}
  void close() override {
    asio::error_code ignored;
    stream_->lowest_layer().close(ignored);
  }

 private:
  using Stream = asio::ssl::stream<Socket>;
  std::shared_ptr<Stream> stream_;  // outlives what is under way
};

}  // namespace

std::unique_ptr<Wire> make_wire(Socket socket, TlsServer* tls) {
  if (tls == nullptr) return std::make_unique<PlainWire>(std::move(socket));
  return std::make_unique<TlsWire>(std::move(socket), tls->context());
}

}  // namespace weft::daemon::server
