#include "daemon/service/transport/http_request.hpp"

#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <charconv>

namespace weft::daemon::server {
namespace {

namespace http = boost::beast::http;

boost::beast::string_view of_beast(std::string_view text) {
  return {text.data(), text.size()};
}

std::string_view of_std(boost::beast::string_view text) {
  return {text.data(), text.size()};
}

int status_of(const boost::system::error_code& error) {
  if (error == http::error::header_limit) return 431;
  if (error == http::error::body_limit || error == http::error::buffer_overflow) return 413;
  return 400;
}

/// Decodes "%2C" and "+" of a query, RFC 3986 section 2.1; invalid escapes are kept.
std::string decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned byte = 0;
    const bool escape = text[i] == '%' && i + 2 < text.size();
    if (escape &&
        std::from_chars(&text[i + 1], &text[i + 1] + 2, byte, 16).ptr == &text[i + 1] + 2) {
      out.push_back(static_cast<char>(byte));
      i += 2;
    } else {
      out.push_back(text[i] == '+' ? ' ' : text[i]);
    }
  }
  return out;
}

}  // namespace

struct HttpRequest::Parser {
  http::request_parser<http::string_body> beast;
};

HttpRequest::HttpRequest(const RequestBounds& bounds) : parser_(std::make_unique<Parser>()) {
  parser_->beast.header_limit(static_cast<std::uint32_t>(bounds.head_bytes));
  parser_->beast.body_limit(bounds.body_bytes);
}

HttpRequest::~HttpRequest() = default;

HttpRequest::Stage HttpRequest::add(std::string_view bytes) {
  if (stage_ == Stage::whole || stage_ == Stage::refused) return stage_;
  auto& beast = parser_->beast;
  held_.append(bytes);
  while (!held_.empty() && !beast.is_done()) {
    boost::system::error_code error;
    const std::size_t used = beast.put(boost::asio::buffer(held_), error);
    held_.erase(0, used);
    if (error == http::error::need_more) return stage_;
    if (error) return refuse(status_of(error));
    if (stage_ == Stage::head && beast.is_header_done()) return head_is_whole();
  }
  return stage_ = beast.is_done() ? Stage::whole : stage_;
}

HttpRequest::Stage HttpRequest::refuse(int status) {
  refusal_ = status;
  held_.clear();
  return stage_ = Stage::refused;
}

HttpRequest::Stage HttpRequest::head_is_whole() {
  const auto& fields = parser_->beast.get();
  // otherwise one of them might be checked and another used
  for (const http::field once :
       {http::field::host, http::field::authorization, http::field::content_type})
    if (fields.count(once) > 1) return refuse(400);
  const bool has_length = fields.count(http::field::content_length) == 1;
  const bool coded = fields.count(http::field::transfer_encoding) > 0;
  if (coded || (fields.method() == http::verb::post && !has_length)) return refuse(411);
  return stage_ = parser_->beast.is_done() ? Stage::whole : Stage::body;
}

std::string_view HttpRequest::method() const {
  return of_std(parser_->beast.get().method_string());
}

std::string_view HttpRequest::path() const {
  const std::string_view target = of_std(parser_->beast.get().target());
  return target.substr(0, target.find('?'));
}

std::string_view HttpRequest::header(std::string_view name) const {
  return of_std(parser_->beast.get()[of_beast(name)]);
}

std::optional<std::string> HttpRequest::parameter(std::string_view name) const {
  const std::string_view target = of_std(parser_->beast.get().target());
  for (std::size_t begin = target.find('?'); begin != std::string_view::npos;) {
    const std::size_t end = target.find('&', begin + 1);
    const std::string_view pair = target.substr(begin + 1, end - begin - 1);
    const std::size_t equals = std::min(pair.find('='), pair.size());
    if (decoded(pair.substr(0, equals)) == name)
      return decoded(pair.substr(std::min(equals + 1, pair.size())));
    begin = end;
  }
  return std::nullopt;
}

bool HttpRequest::awaits_continue() const {
  const auto& head = parser_->beast.get();
  return head.version() >= 11 && boost::beast::iequals(head[http::field::expect], "100-continue");
}

const std::string& HttpRequest::body() const {
  return parser_->beast.get().body();
}

}  // namespace weft::daemon::server
