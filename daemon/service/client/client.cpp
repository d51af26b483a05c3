#include "daemon/service/client/client.hpp"

#include <array>
#include <nlohmann/json.hpp>

#include "daemon/service/rpc/message.hpp"

namespace weft::daemon::client {
namespace {

using nlohmann::json;

tl::unexpected<Error> gone() {
  return fail({.code = Errc::io,
               .where = "weftd",
               .what = "the daemon closed the connection",
               .hint = "Look at its output, then start it again"});
}

/// The daemon's error as one of ours.
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

}  // namespace

Result<Client> Client::open(const Where& where) {
  auto channel = open_channel(where);
  if (!channel) return pass(channel.error());
  Client client(std::move(*channel));
  const auto greeting = client.read_line();
  if (!greeting) {
    Error error = greeting.error();
    if (where.at.starts_with("tcp://"))
      error.hint = "Where it serves TLS (--tls-cert) its port is tls://HOST:PORT";
    return pass(std::move(error));
  }
  const json hello = json::parse(*greeting, nullptr, false);
  if (!hello.is_object() || hello.value("method", "") != "hello")
    return fail({.code = Errc::parse,
                 .where = where.at,
                 .what = "that is no weftd",
                 .expected = "a greeting"});
  json introduction{{"client", "weft"}, {"protocol", "1.x"}};
  if (!where.token.empty()) introduction["token"] = where.token;
  const auto opened = client.call("session.open", introduction.dump());
  if (!opened) return pass(opened.error());
  return client;
}

Result<Client> Client::open(const std::filesystem::path& socket) {
  return open(Where{socket.string(), {}, {}});
}

Status Client::send_line(std::string_view line) {
  std::string bytes(line);
  bytes.push_back('\n');
  return channel_->send(bytes);
}

Result<std::string> Client::read_line() {
  std::array<char, 16384> bytes{};
  for (;;) {
    if (const std::size_t end = held_.find('\n'); end != std::string::npos) {
      std::string line = held_.substr(0, end);
      held_.erase(0, end + 1);
      return line;
    }
    const auto count = channel_->receive(bytes);
    if (!count) return pass(count.error());
    if (*count == 0) return gone();
    held_.append(bytes.data(), *count);
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
      return fail({.code = Errc::parse, .where = "weftd", .what = "the daemon sent no JSON"});
    if (message.value("method", "") == "event") {
      events_.push_back(message.at("params").dump());
    } else if (const json answers = message.value("id", json());
               answers == id || (answers.is_null() && message.contains("error"))) {
      // Without an id: the last word before the connection ends, as when a token's time is over.
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

Status Client::halt(bool emergency) {
  return send_line(emergency ? rpc::emergency_line : rpc::halt_line);
}

}  // namespace weft::daemon::client
