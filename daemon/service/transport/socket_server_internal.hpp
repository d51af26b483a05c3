#pragma once
// Parts of SocketServer, for socket_server.cpp: the list of connections, and one connection.

#include <sys/types.h>

#include <array>
#include <asio/generic/stream_protocol.hpp>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/local/stream_protocol.hpp>
#include <asio/post.hpp>
#include <asio/steady_timer.hpp>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/service/transport/socket_server.hpp"

namespace weft::daemon::server {

struct SocketServer::Parts {
  class Connection;

  Parts(Shared& all, const Limits& at_most, std::filesystem::path at)
      : shared(&all), limits(at_most), path(std::move(at)) {}

  void listen_unix();
  void listen_tcp();
  void welcome(asio::generic::stream_protocol::socket socket, Peer peer,
               asio::ssl::context* through);
  enum class Place {
    none,
    own,
    for_stops  ///< until one is free
  };
  /// Connections of the socket or of the port, oldest first in each list.
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
  std::optional<ino_t> inode;  ///< of `path`; another inode belongs to another daemon
  asio::local::stream_protocol::acceptor local{context};
  asio::ip::tcp::acceptor port{context};
  asio::ssl::context* tls = nullptr;  ///< of the port
  asio::steady_timer ticker{context};
  /// Listeners that could not accept, usually because descriptors ran out; retried at the next
  /// tick.
  std::vector<void (Parts::*)()> resting;
  std::map<std::uint64_t, std::shared_ptr<Connection>> connections;  // oldest first
  std::uint64_t next_number = 1;
};

/// One client. Lives as long as its operations; closed when it exceeds a limit.
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

  void begin() {
    within(server_->limits.handshake, [this] { return greeted_; });
    wire_->begin([self = shared_from_this()](const asio::error_code& error) {
      if (self->closed_) return;
      if (error) return self->close();
      self->send_hello();
    });
  }

  void pump() {
    if (closed_ || finishing_ || ends_with_its_token()) return;
    session_.pump([this] { return !closed_ && unsent_bytes_ < room_bytes; });
  }

  void close() {
    if (std::exchange(closed_, true)) return;
    const auto self = shared_from_this();  // keeps it until this is done
    timeout_timer_.cancel();
    rest_.cancel();
    wire_->close();
    server_->connections.erase(number_);
  }

 private:
  /// Bytes that may wait to be sent; further events are not formatted before.
  static constexpr std::size_t room_bytes = std::size_t{64} << 10;

  void send_hello() {
    greeted_ = true;
    session_.send_hello();
    within(server_->limits.introduction, [this] { return session_.is_open(); });
    read();
  }

  /// Closes the connection unless `so_far()` is true by then; replaces the previous time limit.
  void within(std::chrono::seconds max_wait, std::function<bool()> so_far) {
    timeout_timer_.expires_after(max_wait);
    timeout_timer_.async_wait(
        [self = shared_from_this(), so_far = std::move(so_far)](const asio::error_code& cancelled) {
          if (!cancelled && !so_far()) self->close();
        });
  }

  void read() {
    wire_->read_some(asio::buffer(incoming_),
                     [self = shared_from_this()](const asio::error_code& error, std::size_t count) {
                       if (error == asio::error::eof) return self->on_end_of_input();
                       if (error || self->closed_) return self->close();
                       self->lines_.add({self->incoming_.data(), count});
                       self->work_off();
                     });
  }

  // Executes a halt even without a line end; a client that still reads gets the answer.
  void on_end_of_input() {
    if (closed_ || !session_.on_unfinished_message(lines_.rest())) return close();
    finish();
  }

  // One line per turn, so that other clients, and their halts, come in between.
  void work_off() {
    if (closed_ || finishing_ || ends_with_its_token()) return;
    if (const auto line = lines_.next()) {
      const std::size_t wrong_before = session_.wrong_tokens();
      session_.on_message(*line);
      if (!is_local_ && session_.wrong_tokens() > wrong_before) return back_off();
      return asio::post(server_->context, [self = shared_from_this()] { self->work_off(); });
    }
    if (lines_.overflows()) {
      return end_with(rpc::rpc_error(
          rpc::code::request + 30, "request.too_long",
          {.code = Errc::range,
           .where = "line",
           .what = "line too long",
           .expected = "at most " + std::to_string(server_->limits.line_bytes) + " bytes"}));
    }
    pump();
    read();
  }

  // Each wrong token doubles the wait.
  void back_off() {
    constexpr std::chrono::milliseconds first_rest{100};  // doubled each time
    rest_.expires_after(first_rest * (1U << (session_.wrong_tokens() - 1)));
    rest_.async_wait([self = shared_from_this()](const asio::error_code& cancelled) {
      if (!cancelled) self->work_off();
    });
  }

  /// True if the session is over: then the client gets the reason and is closed.
  bool ends_with_its_token() {
    const auto why = session_.over();
    if (why) end_with(*why);
    return why.has_value();
  }

  void end_with(const rpc::RpcError& why) {
    send(rpc::error_line("null", why));
    finish();
  }

  /// Closes when the client has read everything, or when it does not read in time.
  void finish() {
    finishing_ = true;
    within(server_->limits.introduction, [] { return false; });
    write();
  }

  void send(std::string line) {
    if (closed_ || finishing_) return;
    line.push_back('\n');
    unsent_bytes_ += line.size();
    waiting_.push_back(std::move(line));
    // a client that sends requests but never reads
    if (unsent_bytes_ > server_->limits.unsent_bytes) return close();
    write();
  }

  void write() {
    if (writing_ || closed_) return;
    if (waiting_.empty()) {
      if (finishing_) close();
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
  asio::steady_timer timeout_timer_, rest_;
  std::array<char, 16384> incoming_{};
  rpc::LineBuffer lines_;
  std::deque<std::string> waiting_;
  std::string out_;
  std::size_t unsent_bytes_ = 0;
  bool greeted_ = false, writing_ = false, closed_ = false, is_for_stops_ = false;
  bool finishing_ = false;  ///< closes when the waiting lines are sent
  Session session_;
};

}  // namespace weft::daemon::server
