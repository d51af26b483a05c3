#include "daemon/service/transport/http_server.hpp"

#include <algorithm>

#include "daemon/service/transport/http_server_internal.hpp"
#include "daemon/service/transport/loopback.hpp"

namespace weft::daemon::server {
namespace {

using asio::ip::tcp;
using namespace std::chrono_literals;

constexpr auto pause_without_descriptors = 100ms;  // at once it would fail again

}  // namespace

void HttpServer::Parts::listen() {
  acceptor.async_accept([this](const asio::error_code& error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
      welcome(std::move(socket));
      return listen();
    }
    if (make_room(1)) return listen();  // out of descriptors
    pause.expires_after(pause_without_descriptors);
    pause.async_wait([this](const asio::error_code& cancelled) {
      if (!cancelled) listen();
    });
  });
}

/// Closes the oldest brief connection where there are that many.
bool HttpServer::Parts::make_room(std::size_t most) {
  const auto brief = [](const auto& connection) { return connection->is_brief(); };
  const auto count = std::count_if(connections.begin(), connections.end(), brief);
  if (static_cast<std::size_t>(count) < most) return false;
  const auto oldest = *std::find_if(connections.begin(), connections.end(), brief);
  oldest->close();
  return true;
}

void HttpServer::Parts::welcome(tcp::socket socket) {
  make_room(limits.brief);
  asio::error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  connections.push_back(std::make_shared<Connection>(*this, make_wire(std::move(socket), tls)));
  connections.back()->begin();
}

HttpServer::HttpServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

HttpServer::~HttpServer() {
  for (const auto& connection : Parts::Connections(parts_->connections)) {
    connection->send_close();
    connection->close();
  }
}

Result<std::unique_ptr<HttpServer>> HttpServer::open(asio::io_context& context, const At& at,
                                                     Shared& shared, const HttpLimits& limits) {
  auto parts = std::make_unique<Parts>(context, shared, limits);
  parts->tls = at.tls;
  if (at.tls == nullptr) parts->listening_address = at.address.to_string();
  if (Status ok = listen_on(parts->acceptor, at.address, at.port); !ok)
    return pass(ok.error(), "HTTP");
  parts->listen();
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(parts)));
}

void HttpServer::pump() {
  // one that is closed while it is served leaves the list
  for (const auto& connection : Parts::Connections(parts_->connections)) connection->pump();
}

std::uint16_t HttpServer::port() const {
  asio::error_code ignored;
  return parts_->acceptor.local_endpoint(ignored).port();
}

}  // namespace weft::daemon::server
