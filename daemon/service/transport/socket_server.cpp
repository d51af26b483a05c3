#include "daemon/service/transport/socket_server.hpp"

#include <pwd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <asio/io_context.hpp>
#include <asio/local/stream_protocol.hpp>
#include <asio/post.hpp>
#include <filesystem>
#include <utility>

#include "daemon/service/rpc/session.hpp"
#include "daemon/service/transport/socket_server_internal.hpp"

namespace weft::daemon::server {
namespace {

using asio::generic::stream_protocol;
using Unix = asio::local::stream_protocol;
using asio::ip::tcp;
using namespace std::chrono_literals;

constexpr mode_t socket_mode = 0660;  // owner and group only

std::string name_of(uid_t user) {
  std::array<char, 1024> text{};
  passwd entry{};
  passwd* found = nullptr;
  if (getpwuid_r(user, &entry, text.data(), text.size(), &found) == 0 && found != nullptr)
    return found->pw_name;
  return "uid " + std::to_string(user);
}

/// Fails unless `path` is free or has an old socket.
Status clear_the_way(const std::filesystem::path& path) {
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) return {};
  if (!S_ISSOCK(found.st_mode))
    return fail({.code = Errc::invalid_argument,
                 .where = path.string(),
                 .what = "socket path in use by another file",
                 .expected = "no file, or an old socket",
                 .got = S_ISLNK(found.st_mode) ? "a symbolic link" : "a file or folder",
                 .hint = "Move it away"});
  asio::io_context context;
  Unix::socket probe(context);
  asio::error_code error;
  probe.connect(Unix::endpoint(path.string()), error);
  if (!error)
    return fail({.code = Errc::wrong_state,
                 .where = path.string(),
                 .what = "socket in use by another daemon",
                 .hint = "Stop it, or choose another --socket"});
  std::error_code removed;
  std::filesystem::remove(path, removed);
  if (removed)
    return fail({.code = Errc::io,
                 .where = path.string(),
                 .what = "old socket not removed",
                 .got = removed.message()});
  return {};
}

/// Listens at `path`, mode 0660. Removes the socket of a daemon that died; any other file stays.
/// Errors: wrong_state (another daemon listens there), io, range (path too long), invalid_argument
/// (the path exists and is not a socket, or is a symbolic link).
Status open_unix(Unix::acceptor& acceptor, const std::filesystem::path& path) {
  constexpr std::size_t longest = 107;  // sun_path
  if (path.string().size() > longest)
    return fail({.code = Errc::range,
                 .where = path.string(),
                 .what = "socket path too long",
                 .expected = "at most 107 bytes",
                 .got = std::to_string(path.string().size()) + " bytes"});
  if (Status clear = clear_the_way(path); !clear) return clear;
  asio::error_code error;
  acceptor.open(Unix(), error);
  const mode_t before = umask(static_cast<mode_t>(~socket_mode & 0777));
  if (!error) acceptor.bind(Unix::endpoint(path.string()), error);
  umask(before);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error)
    return fail({.code = Errc::io,
                 .where = path.string(),
                 .what = "listening failed",
                 .got = error.message()});
  return {};
}

/// The socket's mode limits who may open it: the daemon's own user and root are admins, its group
/// operators.
Peer read_peer(int descriptor) {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0)
    return {true, {}, std::nullopt};
  const bool own = credentials.uid == 0 || credentials.uid == geteuid();
  return {true, name_of(credentials.uid), own ? access::Role::admin : access::Role::operator_};
}

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

/// Socket and port count separately, so a flood of the port does not block the socket. If there are
/// too many connections, the oldest one without a session is replaced. Open sessions that fill the
/// socket do not block a halt.
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

void SocketServer::Parts::welcome(stream_protocol::socket socket, Peer peer,
                                  asio::ssl::context* through) {
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
      Peer peer{.address = client_address(socket)};
      welcome(stream_protocol::socket(std::move(socket)), std::move(peer), tls);
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

// Descriptors for connections, without those that a run needs for devices and files, and HTTP. A
// shell permits 1024 unless the program requests more.
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
    pump();  // events that the rate limit allows now
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
  // a copy: a connection that closes leaves the map
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
