#pragma once
// What HttpServer is made of, for http_server.cpp (places and listening) and http_connection.cpp
// (one client and its request).

#include <array>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <initializer_list>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/service/rpc/session.hpp"
#include "daemon/service/transport/http_file.hpp"
#include "daemon/service/transport/http_request.hpp"
#include "daemon/service/transport/http_server.hpp"
#include "daemon/service/transport/wire.hpp"

namespace weft::daemon::server {

struct HttpServer::Parts {
  class Connection;
  using Connections = std::list<std::shared_ptr<Connection>>;  // the oldest first

  Parts(asio::io_context& io, Shared& all, const HttpLimits& at_most)
      : context(&io), shared(&all), limits(at_most), acceptor(io), pause(io) {}

  void listen();
  bool make_room(std::size_t most);
  void welcome(asio::ip::tcp::socket socket);

  asio::io_context* context;
  Shared* shared;
  HttpLimits limits;
  asio::ip::tcp::acceptor acceptor;
  TlsServer* tls = nullptr;
  /// Our name as Host; empty: any, for a certificate says whose name is meant.
  std::string listening_address;
  asio::steady_timer pause;
  Connections connections;
  std::uint64_t next_session = 1;
};

/// One client and its one request. Lives as long as its operations; every stage has its time.
class HttpServer::Parts::Connection : public std::enable_shared_from_this<Connection> {
 public:
  enum class Stage {
    asking,     ///< the request is not whole
    waiting,    ///< for a method's answer
    streaming,  ///< events
    opening,    ///< a file, which is looked at first
    sending,    ///< it
    leaving,    ///< the answer is under way
  };

  Connection(Parts& server, std::unique_ptr<Wire> wire)
      : server_(&server), wire_(std::move(wire)), timeout_timer_(*server.context) {}

  void begin();

  [[nodiscard]] bool is(Stage stage) const { return stage_ == stage; }
  [[nodiscard]] bool is_brief() const { return is(Stage::asking) || is(Stage::leaving); }

  void pump();

  /// The daemon ends. One try: nothing was said yet, so there is room for it.
  void send_close();
  void close();

 private:
  void end_with(const rpc::RpcError& why);

  /// In place of what was to happen before.
  template <class Then>
  void within(std::chrono::nanoseconds max_wait, Then then) {
    timeout_timer_.expires_after(max_wait);
    timeout_timer_.async_wait(
        [self = shared_from_this(), turn = ++turn_, then](const asio::error_code&) {
          if (!self->closed_ && turn == self->turn_) then();
        });
  }

  // Also while an answer is waited for or written: that is how a client that has gone is noticed.
  void read();
  void on_end_of_input();
  void have(std::string_view bytes);

  /// The head is whole: whoever may not ask is told before the body is taken.
  void admit();

  /// What the conversation says at once to this line; empty where that comes later.
  std::string submit(const std::string& line);
  void send_later(std::string line);
  void call();

  /// In a while: what is waited for may never come.
  void give_up_waiting();
  void stream();
  void send_file();
  void have_file(const Result<ServedFile>& file);

  /// The next piece of the file; after the last one no more. One that somebody writes to while it
  /// is sent ends the connection, as nothing else would tell the client.
  void send_more();
  bool has_slot(std::initializer_list<Stage> stages, std::size_t most) const;

  /// The answer, and then no more.
  void leave(const std::string& answer);
  void write();
  void wrote();
  void finish();
  void beat_later();

  Parts* server_;
  std::unique_ptr<Wire> wire_;
  asio::steady_timer timeout_timer_;
  std::array<char, 16384> incoming_{};
  HttpRequest request_;
  Stage stage_ = Stage::asking;
  std::string reply_, unsent_, out_;
  std::size_t ignored_bytes_ = 0;
  std::uint64_t turn_ = 0;
  bool ready_ = false, writing_ = false, closed_ = false, input_ended_ = false;
  std::unique_ptr<Session> session_;
  std::optional<ServedFile> source_;  // sending
  ByteRange left_;                    // of it
};

}  // namespace weft::daemon::server
