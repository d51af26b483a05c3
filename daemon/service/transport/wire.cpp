#include "daemon/service/transport/wire.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <asio/ip/host_name.hpp>
#include <asio/ssl.hpp>
#include <asio/write.hpp>

namespace weft::daemon::server {
namespace {

using asio::ip::tcp;
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
    socket_.shutdown(Socket::shutdown_both, ignored);  // reaches the client despite copies
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
  // Does not wait for the peer's answer: a client that has read everything closes, or is closed.
  void end_of_writing() override {
    stream_->async_shutdown([stream = stream_](const asio::error_code&) {});
  }
  // A TLS record inside another operation's output would be garbage to the peer.
  void write_at_once(asio::const_buffer) override {}
  void close() override {
    asio::error_code ignored;
    stream_->lowest_layer().close(ignored);
  }

 private:
  using Stream = asio::ssl::stream<Socket>;
  std::shared_ptr<Stream> stream_;  // outlives active operations
};

Status readable(const std::filesystem::path& file, const char* what) {
  std::error_code none;
  if (std::filesystem::is_regular_file(file, none)) return {};
  return fail({.code = Errc::not_found,
               .where = file.string(),
               .what = std::string(what) + " file not found",
               .expected = "a PEM file"});
}

Status check_private_key(const std::filesystem::path& key) {
  struct stat found {};
  if (stat(key.c_str(), &found) != 0 || (found.st_mode & 07) == 0) return {};
  return fail({.code = Errc::wrong_state,
               .where = key.string(),
               .what = "key readable by all users",
               .expected = "a file readable by the daemon and its group only",
               .hint = "Run chmod 640 " + key.string()});
}

tl::unexpected<Error> unusable(const char* what, const std::filesystem::path& file,
                               const asio::error_code& error) {
  return fail({.code = Errc::parse,
               .where = file.string(),
               .what = std::string("invalid ") + what,
               .expected = "PEM",
               .got = error.message()});
}

}  // namespace

Result<asio::ip::address> address_to_listen_on(const std::string& text, bool with_tls) {
  asio::error_code error;
  const asio::ip::address address = asio::ip::make_address(text, error);
  if (error)
    return fail({.code = Errc::parse,
                 .where = "--listen",
                 .what = "invalid address",
                 .expected = "127.0.0.1, ::1 or an address of this machine",
                 .got = text});
  if (address.is_loopback() || with_tls) return address;
  return fail({.code = Errc::invalid_argument,
               .where = "--listen",
               .what = "address that other machines can reach needs TLS",
               .expected = "127.0.0.1, or --tls-cert and --tls-key",
               .got = text,
               .hint = "Enable TLS: without it, others on the network can read the tokens"});
}

Status listen_on(tcp::acceptor& acceptor, const asio::ip::address& address, std::uint16_t port) {
  asio::error_code error;
  const tcp::endpoint at(address, port);
  acceptor.open(at.protocol(), error);
  // SO_REUSEADDR, not SO_REUSEPORT: that would let a second daemon take half of our clients.
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(at, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error)
    return fail({.code = Errc::io,
                 .where = address.to_string() + ":" + std::to_string(port),
                 .what = "listening failed",
                 .got = error.message(),
                 .hint = "Check whether another program uses the port"});
  return {};
}

std::string http_url(const asio::ip::address& address, std::uint16_t port, bool tls) {
  std::string host = address.is_v6() ? "[" + address.to_string() + "]" : address.to_string();
  asio::error_code nameless;
  if (address.is_unspecified())  // listens on all addresses: no client can use 0.0.0.0
    if (const std::string name = asio::ip::host_name(nameless); !nameless) host = name;
  return (tls ? "https://" : "http://") + host + ":" + std::to_string(port);
}

std::string format_places(const std::string& listen, std::uint16_t tcp, std::uint16_t http,
                          bool tls) {
  const std::string host = listen.find(':') == std::string::npos ? listen : "[" + listen + "]";
  std::string out;
  if (tcp != 0) out = " on " + host + ":" + std::to_string(tcp) + (tls ? " (TLS)" : "");
  if (http != 0) out += (tls ? ", https://" : ", http://") + host + ":" + std::to_string(http);
  return out;
}

Result<std::shared_ptr<asio::ssl::context>> load_tls(const std::filesystem::path& certificate,
                                                     const std::filesystem::path& key) {
  if (certificate.empty() && key.empty()) return nullptr;
  if (certificate.empty() || key.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "--tls-cert",
                 .what = "certificate or key missing",
                 .expected = "--tls-cert and --tls-key"});
  if (Status ok = readable(certificate, "certificate"); !ok) return pass(ok.error());
  if (Status ok = readable(key, "key"); !ok) return pass(ok.error());
  if (Status ok = check_private_key(key); !ok) return pass(ok.error());
  auto context = std::make_shared<asio::ssl::context>(asio::ssl::context::tls_server);
  SSL_CTX_set_min_proto_version(context->native_handle(), TLS1_2_VERSION);
  // No renegotiation: a client could cause unlimited work.
  SSL_CTX_set_options(context->native_handle(), SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION);
  asio::error_code error;
  context->use_certificate_chain_file(certificate.string(), error);
  if (error) return unusable("certificate", certificate, error);
  context->use_private_key_file(key.string(), asio::ssl::context::pem, error);
  if (error) return unusable("key", key, error);
  if (SSL_CTX_check_private_key(context->native_handle()) != 1)
    return fail(
        {.code = Errc::parse, .where = key.string(), .what = "key does not match the certificate"});
  return context;
}

// Open connections refer to OpenSSL's old context, which lives as long as they do.
Status reload_tls(asio::ssl::context& tls, const std::filesystem::path& certificate,
                  const std::filesystem::path& key) {
  auto loaded = load_tls(certificate, key);
  if (!loaded) return pass(loaded.error());
  tls = std::move(**loaded);
  return {};
}

std::string client_address(const tcp::socket& socket) {
  asio::error_code gone;
  const tcp::endpoint from = socket.remote_endpoint(gone);
  if (gone) return {};
  const asio::ip::address address = from.address();
  if (!address.is_v6()) return address.to_string();
  const asio::ip::address_v6 v6 = address.to_v6();
  if (v6.is_v4_mapped()) return asio::ip::make_address_v4(asio::ip::v4_mapped, v6).to_string();
  asio::ip::address_v6::bytes_type network = v6.to_bytes();
  std::fill(network.begin() + 8, network.end(), std::uint8_t{0});
  return asio::ip::address_v6(network).to_string();
}

std::unique_ptr<Wire> make_wire(Socket socket, asio::ssl::context* tls) {
  if (tls == nullptr) return std::make_unique<PlainWire>(std::move(socket));
  return std::make_unique<TlsWire>(std::move(socket), *tls);
}

}  // namespace weft::daemon::server
