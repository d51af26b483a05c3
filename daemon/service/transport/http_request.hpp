#pragma once
// One HTTP/1.x request out of the bytes of a connection, within bounds; no socket. The head can be
// judged before a byte of the body is taken. Source: RFC 9112; the parser is Boost.Beast's.

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/service/rpc/message.hpp"

namespace weft::daemon::server {

struct RequestBounds {
  std::size_t head_bytes = std::size_t{16} << 10;  ///< request line and header lines
  std::size_t body_bytes = rpc::most_line_bytes;
};

class HttpRequest {
 public:
  enum class Stage {
    head,     ///< more of it is to come
    body,     ///< the head is whole; what of the body came with it is not looked at yet
    whole,    ///< what follows is ignored
    refused,  ///< see refusal(); what follows is ignored
  };
  explicit HttpRequest(const RequestBounds& bounds = {});
  ~HttpRequest();

  /// Takes what came; stops where the head ends: add({}) goes on with the body.
  Stage add(std::string_view bytes);
  [[nodiscard]] Stage stage() const { return stage_; }
  /// Why not: 400 (not HTTP/1.x, or a header that counts given twice), 411 (a body without
  /// Content-Length, chunked for instance), 413 (the body is too long), 431 (the head is).
  [[nodiscard]] int refusal() const { return refusal_; }

  // Of the head, once it is whole.
  [[nodiscard]] std::string_view method() const;
  [[nodiscard]] std::string_view path() const;
  /// Empty where there is none.
  [[nodiscard]] std::string_view header(std::string_view name) const;
  /// Of the query, decoded; nothing where there is none of that name.
  [[nodiscard]] std::optional<std::string> parameter(std::string_view name) const;
  /// The client waits for "100 Continue" before it sends the body.
  [[nodiscard]] bool awaits_continue() const;

  [[nodiscard]] const std::string& body() const;

 private:
  Stage refuse(int status);
  Stage head_is_whole();

  struct Parser;
  std::unique_ptr<Parser> parser_;
  std::string held_;  // not parsed yet: a line that is cut
  Stage stage_ = Stage::head;
  int refusal_ = 0;
};

}  // namespace weft::daemon::server
