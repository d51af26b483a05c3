#include "daemon/service/client/client.hpp"

#include <sys/un.h>

#include <array>
#include <asio/connect.hpp>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/local/stream_protocol.hpp>
#include <asio/ssl.hpp>
#include <asio/write.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>

namespace weft::daemon::client {
namespace {

using asio::ip::tcp;
using nlohmann::json;
using Unix = asio::local::stream_protocol;

tl::unexpected<Error> gone(std::string got, std::string advice = {}) {
  return fail({.code = Errc::io,
               .where = "weftd",
               .what = "connection closed by the daemon",
               .got = std::move(got),
               .hint = std::move(advice)});
}

/// Converts the daemon's error to an Error; its kind goes into `kind`.
tl::unexpected<Error> refusal_from(const json& error, std::string& kind) {
  const json data = error.value("data", json::object());
  kind = data.value("kind", "");
  return fail({.code = Errc::wrong_state,
               .where = data.value("where", ""),
               .what = error.value("message", "refused"),
               .expected = data.value("expected", ""),
               .got = data.value("got", ""),
               .hint = data.value("hint", "")});
}

constexpr std::chrono::seconds max_wait{10};  // to connect and for the TLS handshake
constexpr const char* hint = "Start weftd, or name its socket with --socket or WEFT_SOCKET";

tl::unexpected<Error> unreachable_error(const std::string& at, const std::string& why) {
  return fail({.code = Errc::not_found,
               .where = at,
               .what = "daemon not reachable",
               .got = why,
               .hint = hint});
}

/// Channel over any Asio stream; `context` is the stream's own.
template <class Stream>
class StreamChannel final : public Channel {
 public:
  StreamChannel(std::unique_ptr<asio::io_context> context, std::unique_ptr<asio::ssl::context> tls,
                std::unique_ptr<Stream> stream)
      : context_(std::move(context)), tls_(std::move(tls)), stream_(std::move(stream)) {}

  Status send(std::string_view bytes) override {
    asio::error_code error;
    asio::write(*stream_, asio::buffer(bytes.data(), bytes.size()), error);
    if (error) return gone(error.message());
    return {};
  }

  Result<std::size_t> receive(std::span<char> into) override {
    asio::error_code error;
    const std::size_t count = stream_->read_some(asio::buffer(into.data(), into.size()), error);
    if (error == asio::error::eof || error == asio::ssl::error::stream_truncated)
      return std::size_t{0};
    if (error) return gone(error.message());
    return count;
  }

 private:
  std::unique_ptr<asio::io_context> context_;
  std::unique_ptr<asio::ssl::context> tls_;
  std::unique_ptr<Stream> stream_;
};

Result<std::unique_ptr<Channel>> open_unix(const std::string& path) {
  if (path.size() >= sizeof(sockaddr_un::sun_path))
    return fail({.code = Errc::range, .where = path, .what = "socket path too long"});
  auto context = std::make_unique<asio::io_context>(1);
  auto socket = std::make_unique<Unix::socket>(*context);
  asio::error_code error;
  socket->connect(Unix::endpoint(path), error);
  if (error == asio::error::access_denied || error == asio::error::no_permission)
    return fail({.code = Errc::io,
                 .where = path,
                 .what = "no permission for the daemon's socket",
                 .got = error.message(),
                 .hint = "Join the socket's group, or connect to the daemon's port with a token"});
  if (error && path.find('/') == std::string::npos && path.find(':') != std::string::npos)
    return fail({.code = Errc::not_found,
                 .where = path,
                 .what = "socket not found",
                 .expected = "tls://HOST:PORT or tcp://HOST:PORT",
                 .hint = "Give the port with its protocol"});
  if (error) return unreachable_error(path, error.message());
  return std::make_unique<StreamChannel<Unix::socket>>(std::move(context), nullptr,
                                                       std::move(socket));
}

struct HostPort {
  std::string host, port;
};

/// Parses "HOST:PORT"; an IPv6 address is in brackets.
Result<HostPort> split(const std::string& at, std::string_view text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0 || colon + 1 == text.size())
    return fail({.code = Errc::parse,
                 .where = at,
                 .what = "invalid daemon address",
                 .expected = "tls://HOST:PORT",
                 .got = std::string(text)});
  std::string_view host = text.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  return HostPort{std::string(host), std::string(text.substr(colon + 1))};
}

/// Runs the pending operation for at most `max_wait` and returns its result.
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
                   .what = "token not sent without TLS",
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
                 .what = "invalid CA certificates",
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
  if (is_no_address)  // the macro for it uses an old-style cast
    SSL_ctrl(stream->native_handle(), SSL_CTRL_SET_TLSEXT_HOSTNAME, TLSEXT_NAMETYPE_host_name,
             name.data());
  stream->set_verify_callback(asio::ssl::host_name_verification(to.host));
  std::optional<asio::error_code> done;
  stream->async_handshake(Stream::client, [&done](const asio::error_code& e) { done = e; });
  if (const asio::error_code outcome = finished(*context, done); outcome)
    return fail({.code = outcome == asio::error::timed_out ? Errc::timeout : Errc::wrong_state,
                 .where = at,
                 .what = "TLS handshake with the daemon failed",
                 .expected = "a certificate signed by a CA of --tls-ca",
                 .got = outcome.message()});
  return std::make_unique<StreamChannel<Stream>>(std::move(context), std::move(*tls),
                                                 std::move(stream));
}

Result<std::unique_ptr<Channel>> open_channel(const Where& where) {
  constexpr std::string_view tls = "tls://", plain = "tcp://";
  const std::string_view at = where.at;
  if (!at.starts_with(tls) && !at.starts_with(plain)) return open_unix(where.at);
  const auto to = split(where.at, at.substr(tls.size()));
  if (!to) return pass(to.error());
  return at.starts_with(tls) ? open_tls(where.at, *to, where.tls_ca) : open_tcp(where.at, *to);
}

}  // namespace

Result<Client> Client::open(const Where& where) {
  auto channel = open_channel(where);
  if (!channel) return pass(channel.error());
  Client client(std::move(*channel));
  const auto greeting = client.read_line();
  if (!greeting) {
    Error error = greeting.error();
    if (where.at.starts_with("tcp://"))
      error.hint = "Use tls://HOST:PORT if the daemon serves TLS (--tls-cert)";
    return pass(std::move(error));
  }
  const json hello = json::parse(*greeting, nullptr, false);
  if (!hello.is_object() || hello.value("method", "") != "hello")
    return fail({.code = Errc::parse,
                 .where = where.at,
                 .what = "not a weftd daemon",
                 .expected = "the greeting of weftd"});
  json introduction{{"client", "weft"}, {"protocol", "1.x"}};
  if (!where.token.empty()) introduction["token"] = where.token;
  const auto opened = client.call("session.open", introduction.dump());
  if (!opened) return pass(opened.error());
  return client;
}

Result<Client> Client::open(const std::filesystem::path& socket) {
  return open(Where{socket.string()});
}

Status Client::send_line(std::string_view line) {
  std::string bytes(line);
  bytes.push_back('\n');
  return channel_->send(bytes);
}

Result<std::string> Client::read_line() {
  std::array<char, 16384> bytes{};
  for (;;) {
    if (auto line = lines_.next()) return std::move(*line);
    const auto count = channel_->receive(bytes);
    if (!count) return pass(count.error());
    if (*count == 0) return gone({}, "Check the output of the daemon, then restart it");
    lines_.add({bytes.data(), *count});
  }
}

Result<std::string> Client::call(std::string_view method, std::string_view params_json) {
  const std::int64_t id = next_id_++;
  std::string request = R"({"jsonrpc":"2.0","id":)" + std::to_string(id) + R"(,"method":)" +
                        json(method).dump() + R"(,"params":)";
  request.append(params_json).append("}");
  if (Status sent = send_line(request); !sent) return pass(sent.error());
  for (;;) {
    const auto line = read_line();
    if (!line) return pass(line.error());
    const json message = json::parse(*line, nullptr, false);
    if (!message.is_object())
      return fail(
          {.code = Errc::parse, .where = "weftd", .what = "answer of the daemon is not JSON"});
    if (message.value("method", "") == "event") {
      events_.push_back(message.at("params").dump());
    } else if (const json answers = message.value("id", json());
               answers == id || (answers.is_null() && message.contains("error"))) {
      // An error without an id is the last message before the daemon closes, as when a token
      // expires.
      if (message.contains("error")) return refusal_from(message["error"], refusal_);
      return message.at("result").dump();
    }
  }
}

Result<std::string> Client::next_event() {
  while (events_.empty()) {
    const auto line = read_line();
    if (!line) return pass(line.error());
    const json message = json::parse(*line, nullptr, false);
    if (!message.is_object()) continue;
    if (message.value("method", "") == "event")
      events_.push_back(message.at("params").dump());
    else if (message.contains("error"))
      return refusal_from(message["error"], refusal_);
  }
  std::string first = std::move(events_.front());
  events_.pop_front();
  return first;
}

Status Client::halt(const std::filesystem::path& socket, bool emergency) {
  auto channel = open_channel(Where{socket.string()});
  if (!channel) return pass(channel.error());
  Client client(std::move(*channel));
  if (Status sent = client.send_line(emergency ? rpc::emergency_line : rpc::halt_line); !sent)
    return sent;
  // Reads the greeting, then the event that the rig is latched. Closing the connection earlier
  // could discard the line.
  for (int line = 0; line < 2; ++line)
    if (const auto received = client.read_line(); !received) return pass(received.error());
  return {};
}

}  // namespace weft::daemon::client
