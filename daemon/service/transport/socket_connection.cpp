#include <asio/post.hpp>

#include "daemon/service/transport/socket_server_parts.hpp"

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
    self->greet();
  });
}

void SocketServer::Parts::Connection::close() {
  if (std::exchange(closed_, true)) return;
  const auto self = shared_from_this();  // until this is done
  patience_.cancel();
  rest_.cancel();
  wire_->close();
  server_->connections.erase(number_);
}

void SocketServer::Parts::Connection::greet() {
  greeted_ = true;
  conversation_.greet();
  within(server_->limits.introduction, [this] { return conversation_.introduced(); });
  read();
}

void SocketServer::Parts::Connection::within(std::chrono::seconds patience,
                                             std::function<bool()> so_far) {
  patience_.expires_after(patience);
  patience_.async_wait(
      [self = shared_from_this(), so_far = std::move(so_far)](const asio::error_code& cancelled) {
        if (!cancelled && !so_far()) self->close();
      });
}

void SocketServer::Parts::Connection::read() {
  wire_->read_some(asio::buffer(incoming_),
                   [self = shared_from_this()](const asio::error_code& error, std::size_t count) {
                     if (error == asio::error::eof) return self->has_said_all();
                     if (error || self->closed_) return self->close();
                     self->have(count);
                   });
}

void SocketServer::Parts::Connection::has_said_all() {
  if (closed_ || !conversation_.hear_unfinished(lines_.rest())) return close();
  last_words_ = true;
  within(server_->limits.introduction, [] { return false; });
  write();
}

void SocketServer::Parts::Connection::work_off() {
  if (closed_ || last_words_ || ends_with_its_token()) return;
  if (const auto line = lines_.next()) {
    const std::size_t wrong_before = conversation_.wrong_tokens();
    conversation_.hear(*line);
    if (!is_local_ && conversation_.wrong_tokens() > wrong_before) return rest_a_while();
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

void SocketServer::Parts::Connection::rest_a_while() {
  rest_.expires_after(first_rest * (1U << (conversation_.wrong_tokens() - 1)));
  rest_.async_wait([self = shared_from_this()](const asio::error_code& cancelled) {
    if (!cancelled) self->work_off();
  });
}

bool SocketServer::Parts::Connection::ends_with_its_token() {
  const auto why = conversation_.over();
  if (why) end_with(*why);
  return why.has_value();
}

void SocketServer::Parts::Connection::end_with(const rpc::RpcError& why) {
  send(rpc::error_line("null", why));
  last_words_ = true;
  within(server_->limits.introduction, [] { return false; });
  write();
}

void SocketServer::Parts::Connection::send(std::string line) {
  if (closed_ || last_words_) return;
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

}  // namespace weft::daemon::server
