#include "daemon/service/client/channel.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <asio/connect.hpp>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/local/stream_protocol.hpp>
#include <asio/ssl.hpp>
#include <asio/write.hpp>
#include <chrono>
#include <optional>

namespace weft::daemon::client {
namespace {

using asio::ip::tcp;
using Unix = asio::local::stream_protocol;

constexpr std::chrono::seconds max_wait{10};  // to connect and to shake hands
constexpr const char* hint = "Start weftd, or name its socket with --socket or WEFT_SOCKET";

tl::unexpected<Error> unreachable_error(const std::string& at, const std::string& why) {
  return fail({.code = Errc::not_found,
               .where = at,
               .what = "no daemon answers",
               .got = why,
               .hint = hint});
}

/// Bytes over whatever Asio takes for a stream; `context` is that stream's.
template <class Stream>
class StreamChannel final : public Channel {
 public:
  StreamChannel(std::unique_ptr<asio::io_context> context, std::unique_ptr<asio::ssl::context> tls,
                std::unique_ptr<Stream> stream)
      : context_(std::move(context)), tls_(std::move(tls)), stream_(std::move(stream)) {}

  Status send(std::string_view bytes) override {
    asio::error_code error;
    asio::write(*stream_, asio::buffer(bytes.data(), bytes.size()), error);
    if (error)
      return fail({.code = Errc::io,
                   .where = "weftd",
                   .what = "the daemon closed the connection",
                   .got = error.message()});
    return {};
  }

  Result<std::size_t> receive(std::span<char> into) override {
    asio::error_code error;
    const std::size_t count = stream_->read_some(asio::buffer(into.data(), into.size()), error);
    if (error == asio::error::eof || error == asio::ssl::error::stream_truncated)
      return std::size_t{0};
    if (error)
      return fail({.code = Errc::io,
                   .where = "weftd",
                   .what = "the daemon closed the connection",
                   .got = error.message()});
    return count;
  }

 private:
  std::unique_ptr<asio::io_context> context_;
  std::unique_ptr<asio::ssl::context> tls_;
  std::unique_ptr<Stream> stream_;
};

Result<std::unique_ptr<Channel>> open_unix(const std::string& path) {
  if (path.size() >= sizeof(sockaddr_un::sun_path))
    return fail({.code = Errc::range, .where = path, .what = "the socket's path is too long"});
  auto context = std::make_unique<asio::io_context>(1);
  auto socket = std::make_unique<Unix::socket>(*context);
  asio::error_code error;
  socket->connect(Unix::endpoint(path), error);
  if (error == asio::error::access_denied || error == asio::error::no_permission)
    return fail({.code = Errc::io,
                 .where = path,
                 .what = "the daemon's socket is not for this user",
                 .got = error.message(),
                 .hint = "Be of the socket's group, or come with a token to the daemon's port"});
  if (error && path.find('/') == std::string::npos && path.find(':') != std::string::npos)
    return fail({.code = Errc::not_found,
                 .where = path,
                 .what = "there is no such socket",
                 .expected = "tls://HOST:PORT or tcp://HOST:PORT",
                 .hint = "A port is named with its protocol"});
  if (error) return unreachable_error(path, error.message());
  return std::make_unique<StreamChannel<Unix::socket>>(std::move(context), nullptr,
                                                       std::move(socket));
}

struct HostPort {
  std::string host, port;
};

/// "HOST:PORT", an IPv6 address in brackets.
Result<HostPort> split(const std::string& at, std::string_view text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0 || colon + 1 == text.size())
    return fail({.code = Errc::parse,
                 .where = at,
                 .what = "not a daemon's address",
                 .expected = "tls://HOST:PORT",
                 .got = std::string(text)});
  std::string_view host = text.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  return HostPort{std::string(host), std::string(text.substr(colon + 1))};
}

/// Runs what was begun, for so long; what it came to.
asio::error_code finished(asio::io_context& context, const std::optional<asio::error_code>& done) {
  context.restart();
  context.run_for(max_wait);
  return done.value_or(asio::error_code(asio::error::timed_out));
}

Status connect(asio::io_context& context, tcp::socket& socket, const std::string& at,
               const HostPort& to, bool only_here) {
  asio::error_code error;
  tcp::resolver resolver(context);
  const auto found = resolver.resolve(to.host, to.port, error);
  if (error) return unreachable_error(at, error.message());
  for (const auto& entry : found)
    if (only_here && !entry.endpoint().address().is_loopback())
      return fail({.code = Errc::invalid_argument,
                   .where = at,
                   .what = "a token in the clear would be everybody's",
                   .expected = "tls://HOST:PORT",
                   .got = "tcp:// to another machine"});
  std::optional<asio::error_code> done;
  asio::async_connect(socket, found,
                      [&done](const asio::error_code& e, const tcp::endpoint&) { done = e; });
  if (const asio::error_code outcome = finished(context, done); outcome)
    return unreachable_error(at, outcome.message());
  socket.set_option(tcp::no_delay(true), error);
  return {};
}

Result<std::unique_ptr<Channel>> open_tcp(const std::string& at, const HostPort& to) {
  auto context = std::make_unique<asio::io_context>(1);
  auto socket = std::make_unique<tcp::socket>(*context);
  if (Status ok = connect(*context, *socket, at, to, true); !ok) return pass(ok.error());
  return std::make_unique<StreamChannel<tcp::socket>>(std::move(context), nullptr,
                                                      std::move(socket));
}

Result<std::unique_ptr<asio::ssl::context>> believing(const std::filesystem::path& ca) {
  auto tls = std::make_unique<asio::ssl::context>(asio::ssl::context::tls_client);
  SSL_CTX_set_min_proto_version(tls->native_handle(), TLS1_2_VERSION);
  tls->set_verify_mode(asio::ssl::verify_peer);
  asio::error_code error;
  if (ca.empty())
    tls->set_default_verify_paths(error);
  else
    tls->load_verify_file(ca.string(), error);
  if (error)
    return fail({.code = Errc::parse,
                 .where = ca.string(),
                 .what = "unusable certificates",
                 .expected = "PEM",
                 .got = error.message()});
  return tls;
}

Result<std::unique_ptr<Channel>> open_tls(const std::string& at, const HostPort& to,
                                          const std::filesystem::path& ca) {
  using Stream = asio::ssl::stream<tcp::socket>;
  auto tls = believing(ca);
  if (!tls) return pass(tls.error());
  auto context = std::make_unique<asio::io_context>(1);
  auto stream = std::make_unique<Stream>(*context, **tls);
  if (Status ok = connect(*context, stream->next_layer(), at, to, false); !ok)
    return pass(ok.error());
  asio::error_code is_no_address;
  asio::ip::make_address(to.host, is_no_address);
  std::string name = to.host;
  if (is_no_address)  // the macro for it casts in the old style
    SSL_ctrl(stream->native_handle(), SSL_CTRL_SET_TLSEXT_HOSTNAME, TLSEXT_NAMETYPE_host_name,
             name.data());
  stream->set_verify_callback(asio::ssl::host_name_verification(to.host));
  std::optional<asio::error_code> done;
  stream->async_handshake(Stream::client, [&done](const asio::error_code& e) { done = e; });
  if (const asio::error_code outcome = finished(*context, done); outcome)
    return fail({.code = outcome == asio::error::timed_out ? Errc::timeout : Errc::wrong_state,
                 .where = at,
                 .what = "no handshake with the daemon",
                 .expected = "a certificate that --tls-ca vouches for",
                 .got = outcome.message()});
  return std::make_unique<StreamChannel<Stream>>(std::move(context), std::move(*tls),
                                                 std::move(stream));
}

}  // namespace

Result<std::unique_ptr<Channel>> open_channel(const Where& where) {
  constexpr std::string_view tls = "tls://", plain = "tcp://";
  const std::string_view at = where.at;
  if (!at.starts_with(tls) && !at.starts_with(plain)) return open_unix(where.at);
  const auto to = split(where.at, at.substr(tls.size()));
  if (!to) return pass(to.error());
  return at.starts_with(tls) ? open_tls(where.at, *to, where.tls_ca) : open_tcp(where.at, *to);
}

}  // namespace weft::daemon::client
