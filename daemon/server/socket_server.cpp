#include "daemon/server/socket_server.hpp"

#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <asio/generic/stream_protocol.hpp>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/local/stream_protocol.hpp>
#include <asio/post.hpp>
#include <asio/steady_timer.hpp>
#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "daemon/server/line_buffer.hpp"
#include "daemon/server/loopback.hpp"
#include "daemon/server/unix_socket.hpp"
#include "daemon/server/wire.hpp"

namespace weft::daemon::server {
namespace {

using asio::generic::stream_protocol;
using Unix = asio::local::stream_protocol;
using asio::ip::tcp;
using namespace std::chrono_literals;

constexpr auto tick_period = 20ms;
constexpr auto first_rest = 100ms;  ///< after the first wrong token; twice as long each time
constexpr std::size_t room_bytes = std::size_t{64} << 10;

std::optional<ino_t> inode_of(const std::filesystem::path& path) {
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) return std::nullopt;
  return found.st_ino;
}

}  // namespace

struct SocketServer::Parts {
  class Connection;

  Parts(Shared& all, const Limits& at_most, std::filesystem::path at)
      : shared(&all), limits(at_most), path(std::move(at)) {}

  void listen_unix();
  void listen_tcp();
  void welcome(stream_protocol::socket socket, Peer peer, TlsServer* through);
  enum class Place {
    none,
    own,
    for_stops  ///< until one is free
  };
  /// Those of the socket or of the port, the oldest first in each list.
  struct Counted {
    std::vector<std::shared_ptr<Connection>> known, strangers, for_stops;
  };
  [[nodiscard]] Counted count(bool is_local) const;
  [[nodiscard]] Place place_for(bool is_local);
  void give_free_places();
  void next(const asio::error_code& error, void (Parts::*listen)());
  void next_tick(const std::function<void()>& tick);

  asio::io_context context{1};
  Shared* shared;
  Limits limits;
  std::filesystem::path path;
  std::optional<ino_t> inode;  ///< of `path`: where it is another's by now, that is his
  Unix::acceptor local{context};
  tcp::acceptor port{context};
  TlsServer* tls = nullptr;  ///< of the port
  asio::steady_timer ticker{context};
  /// Could accept nobody, for want of a descriptor as a rule; tried again at the next tick.
  std::vector<void (Parts::*)()> resting;
  std::map<std::uint64_t, std::shared_ptr<Connection>> connections;  // the oldest first
  std::uint64_t next_number = 1;
};

/// One client. Lives as long as its operations; closed when it breaks a limit.
class SocketServer::Parts::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Parts& server, std::unique_ptr<Wire> wire, Peer peer)
      : server_(&server),
        number_(server.next_number++),
        is_local_(peer.local),
        wire_(std::move(wire)),
        patience_(server.context),
        rest_(server.context),
        lines_(server.limits.line_bytes),
        conversation_(*server.shared, std::move(peer), "s-" + std::to_string(number_),
                      [this](std::string line) { send(std::move(line)); }) {}

  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] bool is_local() const { return is_local_; }
  [[nodiscard]] bool is_stranger() const { return !conversation_.introduced(); }
  [[nodiscard]] bool has_unsent() const { return unsent_bytes_ > 0; }
  [[nodiscard]] bool is_for_stops() const { return is_for_stops_; }
  void take_place(bool for_stops) {
    is_for_stops_ = for_stops;
    conversation_.keep_to_what_is_urgent(for_stops);
  }

  void begin() {
    within(server_->limits.handshake, [this] { return greeted_; });
    wire_->begin([self = shared_from_this()](const asio::error_code& error) {
      if (self->closed_) return;
      if (error) return self->close();
      self->greet();
    });
  }

  void pump() {
    if (closed_ || last_words_ || ends_with_its_token()) return;
    conversation_.pump([this] { return !closed_ && unsent_bytes_ < room_bytes; });
  }

  void close() {
    if (std::exchange(closed_, true)) return;
    const auto self = shared_from_this();  // until this is done
    patience_.cancel();
    rest_.cancel();
    wire_->close();
    server_->connections.erase(number_);
  }

 private:
  void greet() {
    greeted_ = true;
    conversation_.greet();
    within(server_->limits.introduction, [this] { return conversation_.introduced(); });
    read();
  }

  /// Closed where it has not come so far by then; in place of what was waited
  /// for before.
  void within(std::chrono::seconds patience, std::function<bool()> so_far) {
    patience_.expires_after(patience);
    patience_.async_wait(
        [self = shared_from_this(), so_far = std::move(so_far)](const asio::error_code& cancelled) {
          if (!cancelled && !so_far()) self->close();
        });
  }

  void read() {
    wire_->read_some(asio::buffer(incoming_),
                     [self = shared_from_this()](const asio::error_code& error, std::size_t count) {
                       if (error == asio::error::eof) return self->has_said_all();
                       if (error || self->closed_) return self->close();
                       self->have(count);
                     });
  }

  // A halt is heeded also where its line has no end, and whoever still reads is told.
  void has_said_all() {
    if (closed_ || !conversation_.hear_unfinished(lines_.rest())) return close();
    last_words_ = true;
    within(server_->limits.introduction, [] { return false; });
    write();
  }

  void have(std::size_t count) {
    lines_.add({incoming_.data(), count});
    work_off();
  }

  // One line a turn: others, and what they have to halt, come in between.
  void work_off() {
    if (closed_ || last_words_ || ends_with_its_token()) return;
    if (const auto line = lines_.next()) {
      const std::size_t wrong_before = conversation_.wrong_tokens();
      conversation_.hear(*line);
      if (!is_local_ && conversation_.wrong_tokens() > wrong_before) return rest_a_while();
      return asio::post(server_->context, [self = shared_from_this()] { self->work_off(); });
    }
    if (lines_.overflows()) {
      return end_with(rpc::rpc_error(rpc::code::request + 30, "request.too_long",
                                     {Errc::range,
                                      "line too long",
                                      "line",
                                      std::to_string(server_->limits.line_bytes) + " bytes",
                                      {},
                                      {}}));
    }
    pump();
    read();
  }

  // Who tries tokens waits longer each time.
  void rest_a_while() {
    rest_.expires_after(first_rest * (1U << (conversation_.wrong_tokens() - 1)));
    rest_.async_wait([self = shared_from_this()](const asio::error_code& cancelled) {
      if (!cancelled) self->work_off();
    });
  }

  /// True where that is so: the client has been told, and is closed.
  bool ends_with_its_token() {
    const auto why = conversation_.over();
    if (why) end_with(*why);
    return why.has_value();
  }

  /// Closed when the client has read why, or does not want to.
  void end_with(const rpc::RpcError& why) {
    send(rpc::error_line("null", why));
    last_words_ = true;
    within(server_->limits.introduction, [] { return false; });
    write();
  }

  void send(std::string line) {
    if (closed_ || last_words_) return;
    line.push_back('\n');
    unsent_bytes_ += line.size();
    waiting_.push_back(std::move(line));
    // one that asks and never reads
    if (unsent_bytes_ > server_->limits.unsent_bytes) return close();
    write();
  }

  void write() {
    if (writing_ || closed_) return;
    if (waiting_.empty()) {
      if (last_words_) close();
      return;
    }
    writing_ = true;
    out_.clear();
    while (!waiting_.empty() && out_.size() < room_bytes) {
      out_ += waiting_.front();
      waiting_.pop_front();
    }
    wire_->write(asio::buffer(out_),
                 [self = shared_from_this()](const asio::error_code& error, std::size_t) {
                   self->writing_ = false;
                   if (error) return self->close();
                   self->unsent_bytes_ -= self->out_.size();
                   self->pump();
                   self->write();
                 });
  }

  Parts* server_;
  std::uint64_t number_;
  bool is_local_;
  std::unique_ptr<Wire> wire_;
  asio::steady_timer patience_, rest_;
  std::array<char, 16384> incoming_{};
  LineBuffer lines_;
  std::deque<std::string> waiting_;
  std::string out_;
  std::size_t unsent_bytes_ = 0;
  bool greeted_ = false, writing_ = false, closed_ = false, is_for_stops_ = false;
  bool last_words_ = false;  ///< closed when what waits is sent
  Conversation conversation_;
};

SocketServer::Parts::Counted SocketServer::Parts::count(bool is_local) const {
  Counted out;
  for (const auto& [number, one] : connections) {
    if (one->is_local() != is_local) continue;
    auto& list = one->is_for_stops()  ? out.for_stops
                 : one->is_stranger() ? out.strangers
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
  const std::size_t all = now.known.size() + now.strangers.size();
  if (!now.strangers.empty() && (now.strangers.size() >= limits.strangers || all >= most)) {
    now.strangers.front()->close();
    return Place::own;
  }
  if (all < most) return Place::own;
  if (!is_local || limits.places_for_stops == 0) return Place::none;
  if (now.for_stops.size() >= limits.places_for_stops) now.for_stops.front()->close();
  return Place::for_stops;
}

void SocketServer::Parts::give_free_places() {
  const Counted now = count(true);
  const std::size_t taken = now.known.size() + now.strangers.size();
  std::size_t left = limits.local_connections - std::min(taken, limits.local_connections);
  for (const auto& one : now.for_stops)
    if (left > 0) {
      one->take_place(false);
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
  made->take_place(place == Place::for_stops);
  connections.emplace(made->number(), made);
  made->begin();
}

void SocketServer::Parts::listen_unix() {
  local.async_accept([this](const asio::error_code& error, Unix::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
      const Peer peer = peer_of(socket.native_handle());
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
  if (inode_of(parts_->path) == parts_->inode) std::filesystem::remove(parts_->path, ignored);
}

Result<std::unique_ptr<SocketServer>> SocketServer::open(const Where& where, Shared& shared,
                                                         const Limits& limits) {
  Limits held = limits;
  const std::size_t spare = spare_descriptors();
  held.local_connections = std::min(held.local_connections, spare / 2);
  held.connections = std::min(held.connections, spare - held.local_connections);
  auto parts = std::make_unique<Parts>(shared, held, where.socket);
  if (Status ok = open_unix(parts->local, where.socket); !ok) return pass(ok.error());
  parts->inode = inode_of(where.socket);
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
