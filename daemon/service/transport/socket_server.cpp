#include "daemon/service/transport/socket_server.hpp"

#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <asio/post.hpp>
#include <utility>

#include "daemon/service/transport/loopback.hpp"
#include "daemon/service/transport/socket_server_internal.hpp"
#include "daemon/service/transport/unix_socket.hpp"

namespace weft::daemon::server {
namespace {

using asio::generic::stream_protocol;
using Unix = asio::local::stream_protocol;
using asio::ip::tcp;
using namespace std::chrono_literals;

constexpr auto tick_period = 20ms;

std::optional<ino_t> read_inode(const std::filesystem::path& path) {
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) return std::nullopt;
  return found.st_ino;
}

}  // namespace

SocketServer::Parts::Counted SocketServer::Parts::count(bool is_local) const {
  Counted out;
  for (const auto& [number, one] : connections) {
    if (one->is_local() != is_local) continue;
    auto& list = one->is_for_stops()         ? out.for_stops
                 : one->is_unauthenticated() ? out.unauthenticated
                                             : out.known;
    list.push_back(one);
  }
  return out;
}

/// Of the socket or of the port, which count apart: who floods the port keeps nobody from the
/// socket. The oldest that has not said who it is makes room where there are too many such. Who
/// fills the socket with clients that have keeps nobody from a halt.
SocketServer::Parts::Place SocketServer::Parts::place_for(bool is_local) {
  const Counted now = count(is_local);
  const std::size_t most = is_local ? limits.local_connections : limits.connections;
  const std::size_t all = now.known.size() + now.unauthenticated.size();
  if (!now.unauthenticated.empty() &&
      (now.unauthenticated.size() >= limits.unauthenticated || all >= most)) {
    now.unauthenticated.front()->close();
    return Place::own;
  }
  if (all < most) return Place::own;
  if (!is_local || limits.places_for_stops == 0) return Place::none;
  if (now.for_stops.size() >= limits.places_for_stops) now.for_stops.front()->close();
  return Place::for_stops;
}

void SocketServer::Parts::give_free_places() {
  const Counted now = count(true);
  const std::size_t taken = now.known.size() + now.unauthenticated.size();
  std::size_t left = limits.local_connections - std::min(taken, limits.local_connections);
  for (const auto& one : now.for_stops)
    if (left > 0) {
      one->open_session(false);
      --left;
    }
}

void SocketServer::Parts::welcome(stream_protocol::socket socket, Peer peer, TlsServer* through) {
  const Place place = place_for(peer.local);
  if (place == Place::none) {
    asio::error_code ignored;
    socket.close(ignored);
    return;
  }
  const auto made =
      std::make_shared<Connection>(*this, make_wire(std::move(socket), through), std::move(peer));
  made->open_session(place == Place::for_stops);
  connections.emplace(made->number(), made);
  made->begin();
}

void SocketServer::Parts::listen_unix() {
  local.async_accept([this](const asio::error_code& error, Unix::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
      const Peer peer = read_peer(socket.native_handle());
      welcome(stream_protocol::socket(std::move(socket)), peer, nullptr);
    }
    next(error, &Parts::listen_unix);
  });
}

void SocketServer::Parts::listen_tcp() {
  port.async_accept([this](const asio::error_code& error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
      asio::error_code ignored;
      socket.set_option(tcp::no_delay(true), ignored);
      welcome(stream_protocol::socket(std::move(socket)), {}, tls);
    }
    next(error, &Parts::listen_tcp);
  });
}

void SocketServer::Parts::next(const asio::error_code& error, void (Parts::*listen)()) {
  if (error)
    resting.push_back(listen);
  else
    (this->*listen)();
}

void SocketServer::Parts::next_tick(const std::function<void()>& tick) {
  ticker.expires_after(tick_period);
  ticker.async_wait([this, &tick](const asio::error_code& cancelled) {
    if (cancelled) return;
    for (const auto listen : std::exchange(resting, {})) (this->*listen)();
    give_free_places();
    tick();
    next_tick(tick);
  });
}

namespace {

// What the process may open beside what a run needs for its devices and files, and HTTP. A shell
// lets a program open 1 024 unless it asks for more.
std::size_t spare_descriptors() {
  constexpr std::size_t needed = 200;
  constexpr rlim_t wanted = 8192;
  rlimit found{};
  if (getrlimit(RLIMIT_NOFILE, &found) != 0) return needed;
  if (found.rlim_cur < wanted) {
    const rlimit more{std::min(wanted, found.rlim_max), found.rlim_max};
    if (setrlimit(RLIMIT_NOFILE, &more) == 0) found = more;
  }
  const auto allowed = static_cast<std::size_t>(found.rlim_cur);
  return allowed > 2 * needed ? allowed - needed : allowed / 2;
}

}  // namespace

SocketServer::SocketServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

SocketServer::~SocketServer() {
  for (const auto& [number, connection] : std::map(parts_->connections)) connection->close();
  std::error_code ignored;
  if (read_inode(parts_->path) == parts_->inode) std::filesystem::remove(parts_->path, ignored);
}

Result<std::unique_ptr<SocketServer>> SocketServer::open(const Where& where, Shared& shared,
                                                         const Limits& limits) {
  Limits held = limits;
  const std::size_t spare = spare_descriptors();
  held.local_connections = std::min(held.local_connections, spare / 2);
  held.connections = std::min(held.connections, spare - held.local_connections);
  auto parts = std::make_unique<Parts>(shared, held, where.socket);
  if (Status ok = open_unix(parts->local, where.socket); !ok) return pass(ok.error());
  parts->inode = read_inode(where.socket);
  parts->tls = where.tls;
  if (where.port)
    if (Status ok = listen_on(parts->port, where.address, *where.port); !ok)
      return pass(ok.error());
  return std::unique_ptr<SocketServer>(new SocketServer(std::move(parts)));
}

void SocketServer::run(const std::function<void()>& tick) {
  parts_->listen_unix();
  if (parts_->port.is_open()) parts_->listen_tcp();
  const std::function<void()> all = [this, &tick] {
    tick();
    pump();  // whose rate allows it now
  };
  parts_->next_tick(all);
  parts_->context.run();
}

void SocketServer::stop() {
  parts_->context.stop();
}

void SocketServer::post(std::function<void()> work) {
  asio::post(parts_->context, std::move(work));
}

void SocketServer::pump() {
  // one that is closed while it is served leaves the map
  std::vector<std::shared_ptr<Parts::Connection>> all;
  for (const auto& [number, connection] : parts_->connections) all.push_back(connection);
  for (const auto& connection : all) connection->pump();
}

asio::io_context& SocketServer::context() {
  return parts_->context;
}

std::uint16_t SocketServer::port() const {
  asio::error_code ignored;
  return parts_->port.is_open() ? parts_->port.local_endpoint(ignored).port() : std::uint16_t{0};
}

std::size_t SocketServer::connections() const {
  return parts_->connections.size();
}

bool SocketServer::has_unsent() const {
  return std::ranges::any_of(parts_->connections,
                             [](const auto& each) { return each.second->has_unsent(); });
}

}  // namespace weft::daemon::server
