#include "protocols/rdt/http.hpp"

#include <algorithm>
#include <charconv>

#include "protocols/base/printable.hpp"

namespace weft::protocols::rdt {
namespace {

constexpr std::string_view version = "HTTP/1.";
constexpr std::size_t npos = std::string_view::npos;

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() <= ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() <= ' ') text.remove_suffix(1);
  return text;
}

/// Removes the next line from `text` and returns it without its line end.
std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

tl::unexpected<Error> bad_reply(const char* what, const char* expected, std::string_view got) {
  return fail({.code = Errc::parse, .what = what, .expected = expected, .got = printable(got)});
}

/// Checks "HTTP/1.1 200 OK"; the reason phrase is optional. Errors: as HttpReply::push.
Status check_status_line(std::string_view line) {
  const std::string_view after = line.substr(std::min(version.size(), line.size()));
  const std::string_view code = after.substr(std::min<std::size_t>(2, after.size()));
  const bool well_formed =
      line.starts_with(version) && after.size() >= 5 && is_digit(after[0]) && after[1] == ' ' &&
      std::all_of(code.begin(), code.begin() + 3, is_digit) && (code.size() == 3 || code[3] == ' ');
  if (!well_formed) return bad_reply("status line of the reply malformed", "HTTP/1.1 200", line);
  if (code.starts_with("200")) return {};
  return fail({.code = code.starts_with("404") ? Errc::not_found : Errc::device_refused,
               .what = "page refused by the box",
               .expected = "status 200",
               .got = printable(code)});
}

/// Errors: parse, unless it is an integer of at most largest_page.
Result<std::size_t> read_length(std::string_view text) {
  std::size_t length = 0;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, length);
  if (read.ec == std::errc{} && read.ptr == end && length <= largest_page) return length;
  return bad_reply("length of the reply invalid", "Content-Length of at most 65536", text);
}

}  // namespace

Result<HttpRequest> decode_request_head(std::string_view head) {
  std::string_view line = head.substr(0, head.find('\n'));
  if (line.ends_with('\r')) line.remove_suffix(1);
  const std::size_t first = line.find(' ');
  const std::size_t second = first == std::string_view::npos ? first : line.find(' ', first + 1);
  const std::string_view method = line.substr(0, first);
  if (second == std::string_view::npos || (method != "GET" && method != "HEAD"))
    return fail({.code = Errc::parse,
                 .what = "request is not a GET request",
                 .expected = "GET /path HTTP/1.1",
                 .got = std::string(line.substr(0, 40))});
  std::string_view target = line.substr(first + 1, second - first - 1);
  constexpr std::string_view scheme = "http://";
  if (target.starts_with(scheme)) {
    const std::size_t path = target.find('/', scheme.size());
    target = path == std::string_view::npos ? "/" : target.substr(path);
  }
  const std::size_t mark = target.find('?');
  HttpRequest request;
  request.head_only = method == "HEAD";
  request.path = std::string(target.substr(0, mark));
  if (mark != std::string_view::npos) request.query = std::string(target.substr(mark + 1));
  return request;
}

std::optional<std::string_view> query_value(std::string_view query, std::string_view key) {
  while (!query.empty()) {
    const std::string_view pair = query.substr(0, query.find('&'));
    const std::size_t equals = pair.find('=');
    if (pair.substr(0, equals) == key && equals != std::string_view::npos)
      return pair.substr(equals + 1);
    query.remove_prefix(std::min(query.size(), pair.size() + 1));
  }
  return std::nullopt;
}

std::string http_get(std::string_view path, std::string_view host) {
  return "GET " + std::string(path) + " HTTP/1.1\r\nHost: " + std::string(host) + "\r\n\r\n";
}

std::string http_reply(int status, std::string_view type, std::string_view body,
                       std::string_view location) {
  const char* word = status == 200   ? "OK"
                     : status == 302 ? "Found"
                     : status == 404 ? "Not Found"
                                     : "Bad Request";
  return "HTTP/1.0 " + std::to_string(status) + " " + word +
         (location.empty() ? "" : "\r\nLocation: " + std::string(location)) +
         "\r\nContent-Type: " + std::string(type) +
         "\r\nContent-Length: " + std::to_string(body.size()) + "\r\nConnection: close\r\n\r\n" +
         std::string(body);
}

Status HttpReply::push(ByteView bytes) {
  if (complete()) return {};
  for (const std::uint8_t byte : bytes) text_.push_back(static_cast<char>(byte));
  if (body_at_ == 0) {
    if (Status head = read_head(); !head || body_at_ == 0) return head;
  }
  if (complete() || text_.size() - body_at_ <= largest_page) return {};
  return fail({.code = Errc::parse,
               .what = "page too long",
               .expected = "at most " + std::to_string(largest_page) + " bytes"});
}

/// Reads the head once the blank line has arrived. Bytes that are not HTTP are refused at once.
Status HttpReply::read_head() {
  const std::string_view text = text_;
  const std::size_t common = std::min(text.size(), version.size());
  if (text.substr(0, common) != version.substr(0, common))
    return bad_reply("reply is not HTTP", "HTTP/1.1 200", text);
  const std::size_t with_cr = text.find("\r\n\r\n"), without_cr = text.find("\n\n");
  const std::size_t blank = std::min(with_cr, without_cr);
  if (std::min(blank, text.size()) > largest_reply_head)
    return bad_reply("headers of the reply too long", "at most 8192 bytes", text);
  if (blank == npos) return {};
  std::string_view lines = text.substr(0, blank);
  if (Status s = check_status_line(take_line(lines)); !s) return s;
  if (Status s = read_headers(lines); !s) return s;
  body_at_ = blank + (blank == with_cr ? 4 : 2);
  return {};
}

Status HttpReply::read_headers(std::string_view lines) {
  while (!lines.empty()) {
    const std::string_view line = take_line(lines);
    const bool folded = line.starts_with(' ') || line.starts_with('\t');
    const std::size_t colon = line.find(':');
    if (folded) continue;
    if (colon == npos) return bad_reply("header without a colon", "NAME: VALUE", line);
    const std::string name = lower(line.substr(0, colon));
    const std::string_view value = trimmed(line.substr(colon + 1));
    if (name == "transfer-encoding" && lower(value) != "identity")
      return bad_reply("chunked reply not supported", "Content-Length", value);
    if (name != "content-length") continue;
    const Result<std::size_t> length = read_length(value);
    if (!length) return pass(length.error());
    if (length_ != unknown_length && length_ != *length)
      return bad_reply("reply with two lengths", "one Content-Length", value);
    length_ = *length;
  }
  return {};
}

std::size_t HttpReply::end() const {
  if (body_at_ == 0) return std::string::npos;
  if (length_ != unknown_length)
    return text_.size() >= body_at_ + length_ ? body_at_ + length_ : std::string::npos;
  const std::size_t closing = text_.find("</netft", body_at_);
  const std::size_t last = closing == std::string::npos ? closing : text_.find('>', closing);
  return last == std::string::npos ? last : last + 1;
}

std::string_view HttpReply::body() const {
  return std::string_view(text_).substr(0, end()).substr(body_at_);
}

}  // namespace weft::protocols::rdt
