#include <asio/post.hpp>

#include "daemon/service/transport/socket_server_internal.hpp"

namespace weft::daemon::server {
namespace {

using namespace std::chrono_literals;

constexpr auto first_rest = 100ms;  ///< after the first wrong token; twice as long each time

}  // namespace

void SocketServer::Parts::Connection::begin() {
  within(server_->limits.handshake, [this] { return greeted_; });
  wire_->begin([self = shared_from_this()](const asio::error_code& error) {
    if (self->closed_) return;
    if (error) return self->close();
    self->send_hello();
  });
}

void SocketServer::Parts::Connection::close() {
  if (std::exchange(closed_, true)) return;
  const auto self = shared_from_this();  // until this is done
  timeout_timer_.cancel();
  rest_.cancel();
  wire_->close();
  server_->connections.erase(number_);
}

void SocketServer::Parts::Connection::send_hello() {
  greeted_ = true;
  session_.send_hello();
  within(server_->limits.introduction, [this] { return session_.is_open(); });
  read();
}

void SocketServer::Parts::Connection::within(std::chrono::seconds max_wait,
                                             std::function<bool()> so_far) {
  timeout_timer_.expires_after(max_wait);
  timeout_timer_.async_wait(
      [self = shared_from_this(), so_far = std::move(so_far)](const asio::error_code& cancelled) {
        if (!cancelled && !so_far()) self->close();
      });
}

void SocketServer::Parts::Connection::read() {
  wire_->read_some(asio::buffer(incoming_),
                   [self = shared_from_this()](const asio::error_code& error, std::size_t count) {
                     if (error == asio::error::eof) return self->on_end_of_input();
                     if (error || self->closed_) return self->close();
                     self->have(count);
                   });
}

void SocketServer::Parts::Connection::on_end_of_input() {
  if (closed_ || !session_.on_unfinished_message(lines_.rest())) return close();
  finishing_ = true;
  within(server_->limits.introduction, [] { return false; });
  write();
}

void SocketServer::Parts::Connection::work_off() {
  if (closed_ || finishing_ || ends_with_its_token()) return;
  if (const auto line = lines_.next()) {
    const std::size_t wrong_before = session_.wrong_tokens();
    session_.on_message(*line);
    if (!is_local_ && session_.wrong_tokens() > wrong_before) return back_off();
    return asio::post(server_->context, [self = shared_from_this()] { self->work_off(); });
  }
  if (lines_.overflows()) {
    return end_with(
        rpc::rpc_error(rpc::code::request + 30, "request.too_long",
                       {.code = Errc::range,
                        .where = "line",
                        .what = "line too long",
                        .expected = std::to_string(server_->limits.line_bytes) + " bytes"}));
  }
  pump();
  read();
}

void SocketServer::Parts::Connection::back_off() {
  rest_.expires_after(first_rest * (1U << (session_.wrong_tokens() - 1)));
  rest_.async_wait([self = shared_from_this()](const asio::error_code& cancelled) {
    if (!cancelled) self->work_off();
  });
}

bool SocketServer::Parts::Connection::ends_with_its_token() {
  const auto why = session_.over();
  if (why) end_with(*why);
  return why.has_value();
}

void SocketServer::Parts::Connection::end_with(const rpc::RpcError& why) {
  send(rpc::error_line("null", why));
  finishing_ = true;
  within(server_->limits.introduction, [] { return false; });
  write();
}

void SocketServer::Parts::Connection::send(std::string line) {
  if (closed_ || finishing_) return;
  line.push_back('\n');
  unsent_bytes_ += line.size();
  waiting_.push_back(std::move(line));
  // one that asks and never reads
  if (unsent_bytes_ > server_->limits.unsent_bytes) return close();
  write();
}

void SocketServer::Parts::Connection::write() {
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

}  // namespace weft::daemon::server
