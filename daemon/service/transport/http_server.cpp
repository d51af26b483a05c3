#include "daemon/service/transport/http_server.hpp"

#include <algorithm>
#include <array>
#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <initializer_list>
#include <list>
#include <optional>
#include <utility>

#include "daemon/service/transport/http_answer.hpp"

namespace weft::daemon::server {
namespace {

using asio::ip::tcp;
using namespace std::chrono_literals;

constexpr auto pause_without_descriptors = 100ms;  // an immediate retry would fail again
constexpr auto farewell = 2s;                      // for a client to read the answer and close
// Further input of a refused client is read: otherwise the connection would be reset before the
// client has read the answer.
constexpr std::size_t most_ignored_bytes = std::size_t{4} << 20;
constexpr std::size_t stream_room_bytes = 64 << 10, file_piece_bytes = 256 << 10;

}  // namespace

struct HttpServer::Parts {
  class Connection;
  using Connections = std::list<std::shared_ptr<Connection>>;  // oldest first

  Parts(asio::io_context& io, Shared& all, const HttpLimits& at_most)
      : context(&io), shared(&all), limits(at_most), acceptor(io), pause(io) {}

  void listen();
  bool make_room(std::size_t most);
  void welcome(tcp::socket socket);

  asio::io_context* context;
  Shared* shared;
  HttpLimits limits;
  tcp::acceptor acceptor;
  asio::ssl::context* tls = nullptr;
  /// Accepted Host; empty: any, because under TLS the certificate identifies the server.
  std::string listening_address;
  asio::steady_timer pause;
  Connections connections;
  std::uint64_t next_session = 1;
};

/// One client and its one request. Lives as long as its operations; every stage has a time limit.
class HttpServer::Parts::Connection : public std::enable_shared_from_this<Connection> {
 public:
  enum class Stage {
    asking,     ///< the request is incomplete
    waiting,    ///< for a method's answer
    streaming,  ///< events
    opening,    ///< a file, which is checked first
    sending,    ///< the file
    leaving,    ///< the answer is being sent
  };

  Connection(Parts& server, tcp::socket socket)
      : server_(&server),
        address_(client_address(socket)),
        wire_(make_wire(std::move(socket), server.tls)) {}

  void begin() {
    within(server_->limits.request, [this] {
      if (!ready_) return close();  // no TLS yet: no answer possible
      leave(refusal_text(408));
    });
    wire_->begin([self = shared_from_this()](const asio::error_code& error) {
      if (self->closed_) return;
      if (error) return self->close();
      self->ready_ = true;
      self->read();
    });
  }

  [[nodiscard]] bool is(Stage stage) const { return stage_ == stage; }
  [[nodiscard]] bool is_brief() const { return is(Stage::asking) || is(Stage::leaving); }

  void pump() {
    if (closed_) return;
    if (is(Stage::streaming) || is(Stage::waiting))
      if (const auto why = session_->over())
        return leave(is(Stage::streaming) ? error_event_text(*why)
                                          : answer_text(401, rpc::error_line("null", *why)));
    if (!is(Stage::streaming)) return;
    session_->pump([this] { return unsent_.size() < stream_room_bytes; });
    write();
  }

  /// Call when the daemon ends. One non-blocking write: nothing was sent before, so the buffer has
  /// space.
  void send_close() {
    if (!is(Stage::waiting) && !is(Stage::opening)) return;
    wire_->write_at_once(asio::buffer(daemon_stops_text()));
  }

  void close() {
    if (std::exchange(closed_, true)) return;
    timeout_timer_.cancel();
    wire_->close();
    session_.reset();
    server_->connections.remove(shared_from_this());
  }

 private:
  /// Replaces the previous time limit.
  template <class Then>
  void within(std::chrono::nanoseconds max_wait, Then then) {
    timeout_timer_.expires_after(max_wait);
    timeout_timer_.async_wait(
        [self = shared_from_this(), turn = ++turn_, then](const asio::error_code&) {
          if (!self->closed_ && turn == self->turn_) then();
        });
  }

  // Reads even while an answer is awaited or written, to detect a closed connection.
  void read() {
    wire_->read_some(asio::buffer(incoming_),
                     [self = shared_from_this()](const asio::error_code& error, std::size_t count) {
                       if (self->closed_) return;
                       if (error) return self->on_end_of_input();
                       self->have({self->incoming_.data(), count});
                       if (!self->closed_) self->read();
                     });
  }

  void on_end_of_input() {
    input_ended_ = true;
    // a client that only stops sending may still read
    if (!is(Stage::opening) && !is(Stage::sending) && !(is(Stage::leaving) && writing_)) close();
  }

  void have(std::string_view bytes) {
    if (!is(Stage::asking)) {
      ignored_bytes_ += bytes.size();
      if (ignored_bytes_ > most_ignored_bytes) close();
      return;
    }
    using Of = HttpRequest::Stage;
    Of got = request_.add(bytes);
    if (!session_ && (got == Of::body || got == Of::whole)) {
      admit();
      if (is(Stage::asking)) got = request_.add({});
    }
    if (!is(Stage::asking)) return;
    if (got == Of::refused) return leave(refusal_text(request_.refusal()));
    if (got == Of::whole) call();
  }

  /// Call when the head is complete: refuses a client without access before the body is read.
  void admit() {
    if (const auto refusal = refusal_of_head(request_, server_->listening_address))
      return leave(*refusal);
    if (const auto page = page_answer(request_)) return leave(*page);
    // Only a stream can receive events; a single request cannot.
    const bool stays = request_.path() == "/events";
    const Peer peer{.stays = stays, .address = address_};
    const std::string name = "h-" + std::to_string(server_->next_session++);
    session_ = std::make_unique<Session>(*server_->shared, peer, name,
                                         [this](std::string line) { send_later(std::move(line)); });
    const std::string opened = submit(open_line(request_));
    if (is_error(opened)) return leave(no_session_text(opened));
    if (stays) return stream();
    if (request_.path() == metrics_path) return leave(metrics_answer(request_, *server_->shared));
    if (request_.path().starts_with(data_path)) return send_file();
    if (!request_.awaits_continue()) return;
    unsent_ += "HTTP/1.1 100 Continue\r\n\r\n";
    write();
  }

  /// The session's immediate answer to this line; empty if it comes later.
  std::string submit(const std::string& line) {
    session_->on_message(line);
    return std::exchange(reply_, {});
  }

  void send_later(std::string line) {
    if (is(Stage::waiting)) return leave(answer_text(200, line));
    if (is(Stage::streaming))
      unsent_ += event_text(line, server_->shared->epoch);
    else
      reply_ = std::move(line);
  }

  void call() {
    const auto parsed = rpc::parse_request(request_.body());
    if (!parsed) {
      const std::string refused_line =
          parsed.error().received  // it may still stop a run
              ? submit(request_.body())
              : rpc::error_line(parsed.error().id_json, parsed.error().error);
      return leave(answer_text(is_error(refused_line) ? 400 : 200, refused_line));
    }
    const auto method = server_->shared->methods->find(parsed->method);
    const HttpLimits& most = server_->limits;
    if (method && (*method)->answers_later && !has_slot({Stage::waiting}, most.waiting))
      return leave(too_many_text("waiting calls", most.waiting, "Retry later, or use the socket"));
    const std::string answer = submit(request_.body());
    if (!parsed->id_json) return leave(answer_text(204, {}));
    if (!answer.empty()) return leave(answer_text(200, answer));
    stage_ = Stage::waiting;
    give_up_waiting();
  }

  /// Sets the time limit for an answer that may never come.
  void give_up_waiting() {
    within(server_->limits.answer,
           [this] { leave(no_answer_text(server_->limits.answer.count())); });
  }

  void stream() {
    const HttpLimits& most = server_->limits;
    if (!has_slot({Stage::streaming}, most.streams))
      return leave(too_many_text("event streams", most.streams,
                                 "Close one, or use the socket, which has no such limit"));
    auto from_seq = seen_last(request_, server_->shared->epoch);
    std::string first = submit(subscribe_line(request_, from_seq));
    if (from_seq && is_error(first)) {  // too old: a snapshot instead
      from_seq.reset();
      first = submit(subscribe_line(request_, from_seq));
    }
    if (is_error(first)) return leave(answer_text(400, first));
    stage_ = Stage::streaming;
    unsent_ += stream_head() + event_text(first, server_->shared->epoch, from_seq);
    write();
  }

  void send_file() {
    const HttpLimits& most = server_->limits;
    if (!has_slot({Stage::opening, Stage::sending}, most.files))
      return leave(too_many_text("file downloads", most.files, "Retry later"));
    stage_ = Stage::opening;
    give_up_waiting();
    server_->shared->file(request_.path().substr(data_path.size()),
                          [waits = weak_from_this()](const Result<ServedFile>& file) {
                            const auto self = waits.lock();
                            if (self && !self->closed_ && self->is(Stage::opening))
                              self->have_file(file);
                          });
  }

  void have_file(const Result<ServedFile>& file) {
    if (!file) return leave(no_file_text(file.error(), wants_known_content(request_)));
    FileAnswer answer = file_answer(request_, *file);
    left_ = answer.body;
    if (left_.first == left_.end) return leave(answer.head);
    source_ = *file;
    stage_ = Stage::sending;
    unsent_ += answer.head;
    write();
  }

  /// Sends the next piece of the file, or finishes. If the file is modified meanwhile, closes the
  /// connection: the client has no other way to notice.
  void send_more() {
    const auto piece = std::min<std::uint64_t>(left_.end - left_.first, file_piece_bytes);
    if (piece == 0) return leave({});
    unsent_.resize(piece);
    auto* const bytes = reinterpret_cast<std::uint8_t*>(unsent_.data());
    if (!source_->file->read(left_.first, {bytes, unsent_.size()})) return close();
    const auto now = source_->file->stamp();
    if (!now || *now != source_->as_of) return close();
    left_.first += piece;
    write();
  }

  bool has_slot(std::initializer_list<Stage> stages, std::size_t most) const {
    const auto sits = [&](const auto& one) { return std::ranges::count(stages, one->stage_) > 0; };
    return static_cast<std::size_t>(std::ranges::count_if(server_->connections, sits)) < most;
  }

  /// Sends the answer, then closes.
  void leave(const std::string& answer) {
    stage_ = Stage::leaving;
    unsent_ += answer;
    within(server_->limits.unread, [this] { close(); });
    if (unsent_.empty() && !writing_) return finish();
    write();
  }

  void write() {
    if (writing_ || closed_ || unsent_.empty()) return;
    writing_ = true;
    out_.swap(unsent_);
    unsent_.clear();
    if (is(Stage::streaming) || is(Stage::sending))
      within(server_->limits.unread, [this] { close(); });
    wire_->write(asio::buffer(out_),
                 [self = shared_from_this()](const asio::error_code& error, std::size_t) {
                   self->writing_ = false;
                   if (self->closed_) return;
                   if (error) return self->close();
                   self->wrote();
                 });
  }

  void wrote() {
    if (!unsent_.empty()) return write();
    if (is(Stage::streaming)) return beat_later();
    if (is(Stage::sending)) return send_more();
    if (is(Stage::leaving)) finish();
  }

  void finish() {
    if (input_ended_) return close();
    wire_->end_of_writing();
    within(farewell, [this] { close(); });
  }

  void beat_later() {
    within(server_->limits.heartbeat, [this] {
      unsent_ += ":\n\n";  // a comment
      write();
    });
    pump();
  }

  Parts* server_;
  std::string address_;
  std::unique_ptr<Wire> wire_;
  asio::steady_timer timeout_timer_{*server_->context};
  std::array<char, 16384> incoming_{};
  HttpRequest request_;
  Stage stage_ = Stage::asking;
  std::string reply_, unsent_, out_;
  std::size_t ignored_bytes_ = 0;
  std::uint64_t turn_ = 0;
  bool ready_ = false, writing_ = false, closed_ = false, input_ended_ = false;
  std::unique_ptr<Session> session_;
  std::optional<ServedFile> source_;  // sending
  ByteRange left_;                    // of the file
};

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

/// Closes the oldest brief connection if there are at least `most`. Returns true if it closed one.
bool HttpServer::Parts::make_room(std::size_t most) {
  const auto brief = [](const auto& connection) { return connection->is_brief(); };
  if (static_cast<std::size_t>(std::ranges::count_if(connections, brief)) < most) return false;
  const auto oldest = *std::ranges::find_if(connections, brief);
  oldest->close();
  return true;
}

void HttpServer::Parts::welcome(tcp::socket socket) {
  make_room(limits.brief);
  asio::error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  connections.push_back(std::make_shared<Connection>(*this, std::move(socket)));
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
  // a copy: a connection that closes leaves the list
  for (const auto& connection : Parts::Connections(parts_->connections)) connection->pump();
}

std::uint16_t HttpServer::port() const {
  asio::error_code ignored;
  return parts_->acceptor.local_endpoint(ignored).port();
}

}  // namespace weft::daemon::server
