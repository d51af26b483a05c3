#pragma once
// Parses one HTTP/1.x request from the bytes of a connection, within bounds; no socket. The head
// can be checked before the body is read. Source: RFC 9112; the parser is Boost.Beast's.

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
    head,     ///< incomplete
    body,     ///< the head is complete; body bytes that came with it are not parsed yet
    whole,    ///< later bytes are ignored
    refused,  ///< see refusal(); later bytes are ignored
  };
  explicit HttpRequest(const RequestBounds& bounds = {});
  ~HttpRequest();

  /// Adds received bytes; stops at the end of the head. add({}) then continues with the body.
  Stage add(std::string_view bytes);
  [[nodiscard]] Stage stage() const { return stage_; }
  /// HTTP status of the refusal: 400 (not HTTP/1.x, or a relevant header given twice); 411 (a body
  /// without Content-Length, such as chunked); 413 (body too long); 431 (head too long).
  [[nodiscard]] int refusal() const { return refusal_; }

  // Parts of the head, once it is complete.
  [[nodiscard]] std::string_view method() const;
  [[nodiscard]] std::string_view path() const;
  /// Empty if there is none.
  [[nodiscard]] std::string_view header(std::string_view name) const;
  /// Value in the query, decoded; empty if the name is missing.
  [[nodiscard]] std::optional<std::string> parameter(std::string_view name) const;
  /// True if the client waits for "100 Continue" before it sends the body.
  [[nodiscard]] bool awaits_continue() const;

  [[nodiscard]] const std::string& body() const;

 private:
  Stage refuse(int status);
  Stage head_is_whole();

  struct Parser;
  std::unique_ptr<Parser> parser_;
  std::string held_;  // not parsed yet: an incomplete line
  Stage stage_ = Stage::head;
  int refusal_ = 0;
};

}  // namespace weft::daemon::server
