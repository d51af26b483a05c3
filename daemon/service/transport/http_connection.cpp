#include <algorithm>
#include <chrono>
#include <utility>

#include "daemon/service/transport/http_answer.hpp"
#include "daemon/service/transport/http_file.hpp"
#include "daemon/service/transport/http_server_internal.hpp"

namespace weft::daemon::server {
namespace {

using namespace std::chrono_literals;

constexpr auto farewell = 2s;  // for a client to read the answer and close
// What a refused client still sends is read, or it would be reset before it has read why.
constexpr std::size_t most_ignored_bytes = std::size_t{4} << 20;
constexpr std::size_t stream_room_bytes = std::size_t{64} << 10;
constexpr std::size_t file_piece_bytes = std::size_t{256} << 10;
constexpr std::string_view comment = ":\n\n";

}  // namespace

void HttpServer::Parts::Connection::begin() {
  within(server_->limits.request, [this] {
    if (!ready_) return close();  // its handshake is not over: nothing can be said
    leave(refusal_text(408));
  });
  wire_->begin([self = shared_from_this()](const asio::error_code& error) {
    if (self->closed_) return;
    if (error) return self->close();
    self->ready_ = true;
    self->read();
  });
}

void HttpServer::Parts::Connection::pump() {
  if (closed_) return;
  if (is(Stage::streaming) || is(Stage::waiting)) {
    if (const auto why = session_->over()) return end_with(*why);
  }
  if (!is(Stage::streaming)) return;
  session_->pump([this] { return unsent_.size() < stream_room_bytes; });
  write();
}

void HttpServer::Parts::Connection::send_close() {
  if (!is(Stage::waiting) && !is(Stage::opening)) return;
  wire_->write_at_once(asio::buffer(daemon_stops_text()));
}

void HttpServer::Parts::Connection::close() {
  if (std::exchange(closed_, true)) return;
  timeout_timer_.cancel();
  wire_->close();
  session_.reset();
  server_->connections.remove(shared_from_this());
}

void HttpServer::Parts::Connection::end_with(const rpc::RpcError& why) {
  leave(is(Stage::streaming) ? error_event_text(why)
                             : answer_text(401, rpc::error_line("null", why)));
}

void HttpServer::Parts::Connection::read() {
  wire_->read_some(asio::buffer(incoming_),
                   [self = shared_from_this()](const asio::error_code& error, std::size_t count) {
                     if (self->closed_) return;
                     if (error) return self->on_end_of_input();
                     self->have({self->incoming_.data(), count});
                     if (!self->closed_) self->read();
                   });
}

void HttpServer::Parts::Connection::on_end_of_input() {
  input_ended_ = true;
  // one that only sends no more may read on
  if (!is(Stage::opening) && !is(Stage::sending) && !(is(Stage::leaving) && writing_)) close();
}

void HttpServer::Parts::Connection::have(std::string_view bytes) {
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

void HttpServer::Parts::Connection::admit() {
  if (const auto refusal = refusal_of_head(request_, server_->listening_address))
    return leave(*refusal);
  if (const auto page = page_answer(request_)) return leave(*page);
  // It stays where it is a stream: single requests cannot be sent events.
  const bool stays = request_.path() == "/events";
  session_ = std::make_unique<Session>(*server_->shared, Peer{false, {}, std::nullopt, stays},
                                       "h-" + std::to_string(server_->next_session++),
                                       [this](std::string line) { send_later(std::move(line)); });
  const std::string opened = submit(open_line(request_));
  if (is_error(opened)) return leave(answer_text(401, opened));
  if (stays) return stream();
  if (request_.path().starts_with(data_path)) return send_file();
  if (!request_.awaits_continue()) return;
  unsent_ += "HTTP/1.1 100 Continue\r\n\r\n";
  write();
}

std::string HttpServer::Parts::Connection::submit(const std::string& line) {
  session_->on_message(line);
  return std::exchange(reply_, {});
}

void HttpServer::Parts::Connection::send_later(std::string line) {
  if (is(Stage::waiting)) return leave(answer_text(200, line));
  if (is(Stage::streaming))
    unsent_ += event_text(line, server_->shared->epoch);
  else
    reply_ = std::move(line);
}

void HttpServer::Parts::Connection::call() {
  const auto parsed = rpc::parse_request(request_.body());
  if (!parsed) {
    const std::string refused_line =
        parsed.error().received  // which may stop something all the same
            ? submit(request_.body())
            : rpc::error_line(parsed.error().id_json, parsed.error().error);
    return leave(answer_text(is_error(refused_line) ? 400 : 200, refused_line));
  }
  const auto method = server_->shared->methods->find(parsed->method);
  const HttpLimits& most = server_->limits;
  if (method && (*method)->answers_later && !has_slot({Stage::waiting}, most.waiting))
    return leave(too_many_text("calls wait for their answers", most.waiting,
                               "Ask again later, or use the socket"));
  const std::string answer = submit(request_.body());
  if (!parsed->id_json) return leave(answer_text(204, {}));
  if (!answer.empty()) return leave(answer_text(200, answer));
  stage_ = Stage::waiting;
  give_up_waiting();
}

void HttpServer::Parts::Connection::give_up_waiting() {
  within(server_->limits.answer,
         [this] { leave(no_answer_text(std::chrono::seconds(server_->limits.answer).count())); });
}

void HttpServer::Parts::Connection::stream() {
  const HttpLimits& most = server_->limits;
  if (!has_slot({Stage::streaming}, most.streams))
    return leave(too_many_text("streams of events", most.streams,
                               "Close one, or use the socket, which has no such bound"));
  auto from_seq = seen_last(request_, server_->shared->epoch);
  std::string first = submit(subscribe_line(request_, from_seq));
  if (from_seq && is_error(first)) {  // too long ago: a snapshot instead
    from_seq.reset();
    first = submit(subscribe_line(request_, from_seq));
  }
  if (is_error(first)) return leave(answer_text(400, first));
  stage_ = Stage::streaming;
  unsent_ += stream_head() + event_text(first, server_->shared->epoch, from_seq);
  write();
}

void HttpServer::Parts::Connection::send_file() {
  const HttpLimits& most = server_->limits;
  if (!has_slot({Stage::opening, Stage::sending}, most.files))
    return leave(too_many_text("files are on their way", most.files, "Ask again later"));
  stage_ = Stage::opening;
  give_up_waiting();
  server_->shared->file(request_.path().substr(data_path.size()),
                        [waits = weak_from_this()](const Result<ServedFile>& file) {
                          const auto self = waits.lock();
                          if (self && !self->closed_ && self->is(Stage::opening))
                            self->have_file(file);
                        });
}

void HttpServer::Parts::Connection::have_file(const Result<ServedFile>& file) {
  if (!file) return leave(no_file_text(file.error(), wants_known_content(request_)));
  FileAnswer answer = file_answer(request_, *file);
  left_ = answer.body;
  if (left_.first == left_.end) return leave(answer.head);
  source_ = *file;
  stage_ = Stage::sending;
  unsent_ += answer.head;
  write();
}

void HttpServer::Parts::Connection::send_more() {
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

bool HttpServer::Parts::Connection::has_slot(std::initializer_list<Stage> stages,
                                             std::size_t most) const {
  const auto sits = [&](const auto& other) {
    return std::any_of(stages.begin(), stages.end(), [&](Stage s) { return other->is(s); });
  };
  const auto taken = std::count_if(server_->connections.begin(), server_->connections.end(), sits);
  return static_cast<std::size_t>(taken) < most;
}

void HttpServer::Parts::Connection::leave(const std::string& answer) {
  stage_ = Stage::leaving;
  unsent_ += answer;
  within(server_->limits.unread, [this] { close(); });
  if (unsent_.empty() && !writing_) return finish();
  write();
}

void HttpServer::Parts::Connection::write() {
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

void HttpServer::Parts::Connection::wrote() {
  if (!unsent_.empty()) return write();
  if (is(Stage::streaming)) return beat_later();
  if (is(Stage::sending)) return send_more();
  if (!is(Stage::leaving)) return;
  finish();
}

void HttpServer::Parts::Connection::finish() {
  if (input_ended_) return close();
  wire_->end_of_writing();
  within(farewell, [this] { close(); });
}

void HttpServer::Parts::Connection::beat_later() {
  within(server_->limits.heartbeat, [this] {
    unsent_ += comment;
    write();
  });
  pump();
}

}  // namespace weft::daemon::server
