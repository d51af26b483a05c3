#pragma once
// The subset of HTTP that the pages of a Net F/T box need (device-facts.md, Net F/T pages). Text
// in, text out; no I/O.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"

namespace weft::protocols::rdt {

inline constexpr std::size_t largest_page = 65536;
/// Limit of status line and headers of a reply [bytes]; a longer head is refused.
inline constexpr std::size_t largest_reply_head = 8192;

/// Path and query of "GET /path?query HTTP/1.1 ..." (or "GET http://box/path ..."), once the blank
/// line has arrived. HEAD requests the reply of GET without its body. Errors: parse, for another
/// method or a request that is too long.
struct HttpRequest {
  std::string path, query;
  bool head_only = false;
};
Result<HttpRequest> decode_request_head(std::string_view head);
/// The value of a key in "a=1&b=2"; nullopt if the key is missing.
std::optional<std::string_view> query_value(std::string_view query, std::string_view key);
std::string http_get(std::string_view path, std::string_view host);
/// An HTTP/1.0 reply. The server closes the connection after it, independent of the request: public
/// clients of the box read to the end (no document specifies it). `location`: target of a 302.
std::string http_reply(int status, std::string_view type, std::string_view body,
                       std::string_view location = {});

/// Assembles an HTTP reply: push() the received bytes until complete() or an error. The chunking
/// does not affect the result. Without a Content-Length the page ends with its root element.
class HttpReply {
 public:
  /// Errors: not_found, if the server has no such page (404); parse, if the reply is not HTTP/1,
  /// has a status other than 200, a header without a colon, an unreadable or a second length, is
  /// chunked (Transfer-Encoding) or is too large.
  Status push(ByteView bytes);
  /// Whether the complete body has arrived.
  [[nodiscard]] bool complete() const { return end() != std::string::npos; }
  [[nodiscard]] std::string_view body() const;
  void clear() { *this = {}; }

 private:
  static constexpr std::size_t unknown_length = std::string::npos;
  [[nodiscard]] std::size_t end() const;  ///< end of the body; npos until it is complete
  Status read_head();
  Status read_headers(std::string_view lines);

  std::string text_;
  std::size_t body_at_ = 0;  ///< 0: the head is not complete
  std::size_t length_ = unknown_length;
};

}  // namespace weft::protocols::rdt
