#pragma once
// HTTP as far as the pages of a Net F/T box need it (device-facts.md, Net F/T pages). Text in, text
// out; no I/O.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"

namespace weft::protocols::rdt {

inline constexpr std::size_t largest_page = 65536;
/// Status line and headers of a reply; more is refused.
inline constexpr std::size_t largest_reply_head = 8192;

/// The path and query of "GET /path?query HTTP/1.1 ...", once the blank line has come ("GET
/// http://box/path ..." alike); HEAD asks for what GET would say, without its body. Errors: parse,
/// for another method or an over-long request.
struct HttpRequest {
  std::string path, query;
  bool head_only = false;
};
Result<HttpRequest> decode_request_head(std::string_view head);
/// The value of a key in "a=1&b=2"; nothing when it is not there.
std::optional<std::string_view> query_value(std::string_view query, std::string_view key);
std::string http_get(std::string_view path, std::string_view host);
/// A reply of HTTP/1.0, after which the connection is closed, whatever the request says: public
/// clients of the box read to the end (no document says it). `location`: where a 302 sends to.
std::string http_reply(int status, std::string_view type, std::string_view body,
                       std::string_view location = {});

/// Puts an HTTP reply together: push() what comes, until complete() or an error; any chunking
/// gives the same. Without a Content-Length the page ends with its root element.
class HttpReply {
 public:
  /// Errors: not_found, when the server has no such page (404); parse, when the reply is not
  /// HTTP/1, has another status than 200, a header without a colon, no readable length or two,
  /// comes in chunks (Transfer-Encoding) or is too large.
  Status push(ByteView bytes);
  /// All of the body is there.
  [[nodiscard]] bool complete() const { return end() != std::string::npos; }
  [[nodiscard]] std::string_view body() const;
  void clear() { *this = {}; }

 private:
  static constexpr std::size_t unknown_length = std::string::npos;
  [[nodiscard]] std::size_t end() const;  ///< of the body; npos until all of it is there
  Status read_head();
  Status read_headers(std::string_view lines);

  std::string text_;
  std::size_t body_at_ = 0;  ///< 0: the head is not complete
  std::size_t length_ = unknown_length;
};

}  // namespace weft::protocols::rdt
