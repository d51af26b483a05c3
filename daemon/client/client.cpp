#include "daemon/client/client.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

namespace weft::daemon::client {
namespace {

using nlohmann::json;

tl::unexpected<Error> gone() {
  return fail(Errc::io, "the daemon closed the connection", "weftd", {}, {},
              "Look at its output, then start it again");
}

/// The daemon's error as one of ours.
tl::unexpected<Error> said_no(const json& error) {
  const json data = error.value("data", json::object());
  return fail(Errc::wrong_state, error.value("message", "refused"), data.value("where", ""),
              data.value("expected", ""), data.value("got", ""), data.value("hint", ""));
}

}  // namespace

Client::Client(Client&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      held_(std::move(other.held_)),
      events_(std::move(other.events_)),
      next_id_(other.next_id_) {}

Client& Client::operator=(Client&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(held_, other.held_);
  std::swap(events_, other.events_);
  std::swap(next_id_, other.next_id_);
  return *this;
}

Client::~Client() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<Client> Client::open(const std::filesystem::path& socket) {
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  if (socket.string().size() >= sizeof at.sun_path)
    return fail(Errc::range, "the socket's path is too long", socket.string());
  std::strncpy(at.sun_path, socket.c_str(), sizeof at.sun_path - 1);
  Client client(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (client.descriptor_ < 0 ||
      connect(client.descriptor_, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0)
    return fail(Errc::not_found, "no daemon answers", socket.string(), {}, std::strerror(errno),
                "Start weftd, or name its socket with --socket or WEFT_SOCKET");
  const auto greeting = client.read_line();
  if (!greeting) return pass(greeting.error());
  const json hello = json::parse(*greeting, nullptr, false);
  if (!hello.is_object() || hello.value("method", "") != "hello")
    return fail(Errc::parse, "that is no weftd", socket.string(), "a greeting");
  const auto opened = client.call("session.open", R"({"client":"weft","protocol":"1.x"})");
  if (!opened) return pass(opened.error());
  return client;
}

Status Client::send_line(std::string_view line) {
  std::string bytes(line);
  bytes.push_back('\n');
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t count =
        ::send(descriptor_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return gone();
    sent += static_cast<std::size_t>(count);
  }
  return {};
}

Result<std::string> Client::read_line() {
  std::array<char, 16384> bytes{};
  for (;;) {
    if (const std::size_t end = held_.find('\n'); end != std::string::npos) {
      std::string line = held_.substr(0, end);
      held_.erase(0, end + 1);
      return line;
    }
    const ssize_t count = ::recv(descriptor_, bytes.data(), bytes.size(), 0);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return gone();
    held_.append(bytes.data(), static_cast<std::size_t>(count));
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
    if (!message.is_object()) return fail(Errc::parse, "the daemon sent no JSON", "weftd");
    if (message.value("method", "") == "event") {
      events_.push_back(message.at("params").dump());
    } else if (message.value("id", json()) == id) {
      if (message.contains("error")) return said_no(message["error"]);
      return message.at("result").dump();
    }
  }
}

Result<std::string> Client::next_event() {
  while (events_.empty()) {
    const auto line = read_line();
    if (!line) return pass(line.error());
    const json message = json::parse(*line, nullptr, false);
    if (message.is_object() && message.value("method", "") == "event")
      events_.push_back(message.at("params").dump());
  }
  std::string first = std::move(events_.front());
  events_.pop_front();
  return first;
}

Status Client::halt() {
  return send_line("!halt");
}

}  // namespace weft::daemon::client
