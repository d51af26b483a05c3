// Replies of a box's HTTP server, with any content, and requests.

#include "protocols/rdt/http.hpp"

#include <catch2/catch.hpp>

#include "protocols/rdt/page.hpp"

namespace http_test {

using namespace weft;
using namespace weft::protocols::rdt;

namespace {

ByteView bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

const std::string minimal =
    "<netft><cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt>"
    "<scfgfu>N</scfgfu><scfgtu>Nm</scfgtu></netft>";

/// The first refusal of a reply that comes in pieces of this size.
Status push_in_pieces(HttpReply& reply, const std::string& text, std::size_t piece) {
  for (std::size_t at = 0; at < text.size(); at += piece)
    if (Status s = reply.push(bytes_of(std::string_view(text).substr(at, piece))); !s) return s;
  return {};
}

}  // namespace

TEST_CASE("a reply is put together from any pieces, with and without its length") {
  const std::string with = http_reply(200, "text/xml", minimal);
  const std::string without = "HTTP/1.0 200 OK\r\nServer: x\r\n\r\n" + minimal;
  const std::string bare_lines = "HTTP/1.1 200\nServer: a\n b: folded\n\n" + minimal;
  for (const std::string& text : {with, without, bare_lines})
    for (std::size_t piece = 1; piece < text.size(); piece += 7) {
      HttpReply reply;
      REQUIRE(push_in_pieces(reply, text.substr(0, text.size() - 1), piece));
      CHECK_FALSE(reply.complete());
      REQUIRE(push_in_pieces(reply, text.substr(text.size() - 1), 1));
      REQUIRE(reply.complete());
      CHECK(reply.body() == minimal);
    }
  // Bytes that an old server sends after its page, in the same piece or a later one, do not belong
  // to it.
  HttpReply with_more;
  REQUIRE(with_more.push(bytes_of(without + "\r\n" + std::string(2 * largest_page, 'x'))));
  REQUIRE(with_more.complete());
  CHECK(with_more.body() == minimal);
}

TEST_CASE("a reply that is none is refused with one line, in any pieces") {
  struct Case {
    std::string reply;
    Errc code;
    const char* got;
  };
  const std::string ok = "HTTP/1.1 200 OK\r\n";
  for (const Case& c :
       {Case{"HTTP/1.\r\n\r\n", Errc::parse, "HTTP/1."},
        {"HTTP/1.1\r\n\r\n", Errc::parse, "HTTP/1.1"},
        {"HTTP/1.1 \r\n\r\n", Errc::parse, "HTTP/1.1 "},
        {"HTTP/1.1 2\r\n\r\n", Errc::parse, "HTTP/1.1 2"},
        {"HTTP/1.1 2000\r\n\r\n", Errc::parse, "HTTP/1.1 2000"},
        {"HTTP/1.x 200 OK\r\n\r\n", Errc::parse, "HTTP/1.x 200 OK"},
        {"HTTP/1.1200 OK\r\n\r\n", Errc::parse, "HTTP/1.1200 OK"},
        {"\r\n\r\n", Errc::parse, ""},
        {std::string("\0\1\2\xff", 4), Errc::parse, "????"},
        {"<netft></netft>", Errc::parse, "<netft></netft>"},
        {"HTTP/1.1 404 Not Found\r\nServer: x\r\n\r\n", Errc::not_found, "404 Not Found"},
        {"HTTP/1.1 401 No\r\nWWW-Authenticate: x\r\n\r\n", Errc::device_refused, "401 No"},
        {"HTTP/1.1 500\r\n\r\n", Errc::device_refused, "500"},
        {ok + "Server x\r\n\r\n", Errc::parse, "Server x"},
        {ok + "Content-Length: -1\r\n\r\n", Errc::parse, "-1"},
        {ok + "Content-Length:\r\n\r\n", Errc::parse, ""},
        {ok + "Content-Length: 12x\r\n\r\n", Errc::parse, "12x"},
        {ok + "Content-Length: 65537\r\n\r\n", Errc::parse, "65537"},
        {ok + "Content-Length: 99999999999999999999\r\n\r\n", Errc::parse, "99999999999999999999"},
        {ok + "Content-Length: 5\r\nContent-Length: 6\r\n\r\n", Errc::parse, "6"},
        {ok + "Transfer-Encoding: chunked\r\n\r\n5\r\n", Errc::parse, "chunked"}})
    for (const std::size_t piece : {std::size_t{1}, std::size_t{5}, c.reply.size()}) {
      INFO(c.reply << " in pieces of " << piece);
      HttpReply reply;
      const Status refused = push_in_pieces(reply, c.reply, piece);
      REQUIRE_FALSE(refused);
      CHECK_FALSE(reply.complete());
      CHECK(refused.error().code == c.code);
      if (piece == c.reply.size()) CHECK(refused.error().got == c.got);
      CHECK(to_string(refused.error()).find_first_of("\r\n") == std::string::npos);
    }
}

TEST_CASE("a reply without an end is refused before it fills the memory") {
  const std::string ok = "HTTP/1.1 200 OK\r\n";
  std::string headers = ok, body = ok + "\r\n";
  while (headers.size() <= largest_reply_head) headers += "X: y\r\n";
  body.append(largest_page + 1, 'x');
  for (const std::string& text : {headers, body, std::string(largest_reply_head + 1, 'x')})
    for (const std::size_t piece : {std::size_t{100}, text.size()}) {
      HttpReply reply;
      CHECK_FALSE(push_in_pieces(reply, text, piece));
    }
}

TEST_CASE("a wrong length leaves the reply incomplete, or its page truncated") {
  const std::string head = "HTTP/1.1 200 OK\r\nContent-Length: ";
  HttpReply longer, shorter;
  REQUIRE(longer.push(bytes_of(head + "5000\r\n\r\n" + minimal)));
  CHECK_FALSE(longer.complete());
  REQUIRE(shorter.push(bytes_of(head + "50\r\n\r\n" + minimal)));
  REQUIRE(shorter.complete());
  CHECK_FALSE(decode_settings(shorter.body()));
}

TEST_CASE("requests are read with their query; what is no GET is refused") {
  const auto request = decode_request_head("GET /comm.cgi?comrdtrate=500 HTTP/1.1\r\nHost: x");
  REQUIRE(request);
  CHECK(request->path == "/comm.cgi");
  CHECK(request->query == "comrdtrate=500");
  CHECK(decode_request_head("GET http://192.168.1.1/a?b=1 HTTP/1.1")->path == "/a");
  CHECK(decode_request_head("GET http://192.168.1.1 HTTP/1.1")->path == "/");
  CHECK(decode_request_head("HEAD / HTTP/1.1")->head_only);
  CHECK_FALSE(request->head_only);
  CHECK(query_value("a=1&bb=2&c=", "bb") == "2");
  CHECK(query_value("a=1&bb=2&c=", "c") == "");
  for (const char* absent : {"b", "d", ""}) CHECK_FALSE(query_value("a=1&bb=2&c=&d", absent));
  for (const char* bad : {"", "GET", "POST / HTTP/1.1", "GET /"})
    CHECK_FALSE(decode_request_head(bad));
}

TEST_CASE("replies are of HTTP/1.0, and announce the end of the connection") {
  CHECK(http_reply(200, "text/html", "ab") ==
        "HTTP/1.0 200 OK\r\nContent-Type: text/html\r\nContent-Length: 2\r\n"
        "Connection: close\r\n\r\nab");
  CHECK(http_reply(302, "text/html", "", "/comm.htm")
            .starts_with("HTTP/1.0 302 Found\r\nLocation: /comm.htm\r\n"));
}

}  // namespace http_test
