#pragma once
// What SocketServer is made of, for socket_server.cpp (places and listening) and
// socket_connection.cpp (one client).

#include <sys/types.h>

#include <array>
#include <asio/generic/stream_protocol.hpp>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/local/stream_protocol.hpp>
#include <asio/steady_timer.hpp>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/service/rpc/line_buffer.hpp"
#include "daemon/service/transport/socket_server.hpp"
#include "daemon/service/transport/wire.hpp"

namespace weft::daemon::server {

struct SocketServer::Parts {
  class Connection;

  Parts(Shared& all, const Limits& at_most, std::filesystem::path at)
      : shared(&all), limits(at_most), path(std::move(at)) {}

  void listen_unix();
  void listen_tcp();
  void welcome(asio::generic::stream_protocol::socket socket, Peer peer, TlsServer* through);
  enum class Place {
    none,
    own,
    for_stops  ///< until one is free
  };
  /// Those of the socket or of the port, the oldest first in each list.
  struct Counted {
    std::vector<std::shared_ptr<Connection>> known, unauthenticated, for_stops;
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
  asio::local::stream_protocol::acceptor local{context};
  asio::ip::tcp::acceptor port{context};
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
        timeout_timer_(server.context),
        rest_(server.context),
        lines_(server.limits.line_bytes),
        session_(*server.shared, std::move(peer), "s-" + std::to_string(number_),
                 [this](std::string line) { send(std::move(line)); }) {}

  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] bool is_local() const { return is_local_; }
  [[nodiscard]] bool is_unauthenticated() const { return !session_.is_open(); }
  [[nodiscard]] bool has_unsent() const { return unsent_bytes_ > 0; }
  [[nodiscard]] bool is_for_stops() const { return is_for_stops_; }
  void open_session(bool for_stops) {
    is_for_stops_ = for_stops;
    session_.restrict_to_emergency(for_stops);
  }

  void begin();

  void pump() {
    if (closed_ || finishing_ || ends_with_its_token()) return;
    session_.pump([this] { return !closed_ && unsent_bytes_ < room_bytes; });
  }

  void close();

 private:
  /// That wait to be sent; what is more waits to be made.
  static constexpr std::size_t room_bytes = std::size_t{64} << 10;

  void send_hello();

  /// Closed where it has not come so far by then; in place of what was waited
  /// for before.
  void within(std::chrono::seconds max_wait, std::function<bool()> so_far);

  void read();

  // A halt is heeded also where its line has no end, and whoever still reads is told.
  void on_end_of_input();

  void have(std::size_t count) {
    lines_.add({incoming_.data(), count});
    work_off();
  }

  // One line a turn: others, and what they have to halt, come in between.
  void work_off();

  // Who tries tokens waits longer each time.
  void back_off();

  /// True where that is so: the client has been told, and is closed.
  bool ends_with_its_token();

  /// Closed when the client has read why, or does not want to.
  void end_with(const rpc::RpcError& why);

  void send(std::string line);

  void write();

  Parts* server_;
  std::uint64_t number_;
  bool is_local_;
  std::unique_ptr<Wire> wire_;
  asio::steady_timer timeout_timer_, rest_;
  std::array<char, 16384> incoming_{};
  LineBuffer lines_;
  std::deque<std::string> waiting_;
  std::string out_;
  std::size_t unsent_bytes_ = 0;
  bool greeted_ = false, writing_ = false, closed_ = false, is_for_stops_ = false;
  bool finishing_ = false;  ///< closed when what waits is sent
  Session session_;
};

}  // namespace weft::daemon::server
