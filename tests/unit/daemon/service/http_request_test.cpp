// Parses bytes to one HTTP request: in any pieces, within limits, and the head before the body.

#include <catch2/catch.hpp>
#include <map>
#include <random>
#include <set>

#include "daemon/service/transport/http_request.hpp"

namespace http_request_test {

using weft::daemon::server::HttpRequest;
using HttpStage = HttpRequest::Stage;

namespace {

const std::string post_head =
    "POST /rpc HTTP/1.1\r\nHost: 127.0.0.1:80\r\nContent-Type: application/json\r\n"
    "Authorization: Bearer wft_1\r\nContent-Length: 11\r\n\r\n";

/// Takes everything available, like a server after it has accepted the head.
HttpStage take(HttpRequest& request, std::string_view bytes) {
  request.add(bytes);
  return request.add({});
}

int refusal_of(const std::string& text) {
  HttpRequest request;
  CHECK(take(request, text) == HttpStage::refused);
  return request.refusal();
}

}  // namespace

TEST_CASE("A request gives its method, path, headers by any case, and body") {
  HttpRequest request;
  REQUIRE(take(request, post_head + "{\"id\": 123}") == HttpStage::whole);
  CHECK(request.method() == "POST");
  CHECK(request.path() == "/rpc");
  CHECK(request.header("hOsT") == "127.0.0.1:80");
  CHECK(request.header("Last-Event-ID").empty());
  CHECK(request.body() == "{\"id\": 123}");
  CHECK_FALSE(request.awaits_continue());
}

TEST_CASE("A request is the same in whatever pieces it comes") {
  const std::string text = post_head + "{\"id\": 123}";
  for (std::size_t piece = 1; piece < text.size(); ++piece) {
    HttpRequest request;
    for (std::size_t at = 0; at < text.size(); at += piece) take(request, text.substr(at, piece));
    INFO("pieces of " << piece);
    REQUIRE(request.stage() == HttpStage::whole);
    CHECK(request.path() == "/rpc");
    CHECK(request.body() == "{\"id\": 123}");
  }
}

TEST_CASE("The head can be judged before anything of the body is taken") {
  HttpRequest request;
  CHECK(request.add(post_head + "{\"id\": 123}") == HttpStage::body);
  CHECK(request.header("Authorization") == "Bearer wft_1");
  CHECK(request.body().empty());
  CHECK(request.add({}) == HttpStage::whole);
  CHECK(request.body() == "{\"id\": 123}");
}

TEST_CASE("Bytes after a request are not part of it") {
  HttpRequest request;
  CHECK(take(request, post_head + "{\"id\": 123}GET / HTTP/1.1\r\n\r\n") == HttpStage::whole);
  CHECK(request.add("more") == HttpStage::whole);
  CHECK(request.body() == "{\"id\": 123}");
}

TEST_CASE(
    "A head is refused at its bound, however it comes, and so is a body by its length alone") {
  constexpr std::size_t most = 1000;
  const std::string begin = "GET /events HTTP/1.1\r\nHost: localhost\r\n";
  for (const std::string& filler :
       {std::string("X: 1234\r\n"), "X: " + std::string(most, 'a'), std::string(most, 'b')}) {
    HttpRequest request({most, 100});
    std::size_t sent = 0;
    for (const char c : begin) request.add({&c, 1});
    while (request.stage() == HttpStage::head && sent < 2 * most) {
      request.add(filler);
      sent += filler.size();
    }
    CHECK(request.refusal() == 431);
  }
  HttpRequest fits({most, 100});
  CHECK(fits.add(begin + "X: " + std::string(most - begin.size() - 7, 'a') + "\r\n\r\n") ==
        HttpStage::whole);
  HttpRequest body({most, 100});
  CHECK(body.add("POST /rpc HTTP/1.1\r\nHost: a\r\nContent-Length: 101\r\n\r\n") ==
        HttpStage::refused);
  CHECK(body.refusal() == 413);
}

TEST_CASE("A body without length, or with two, is refused") {
  const std::string begin = "POST /rpc HTTP/1.1\r\nHost: localhost\r\n";
  CHECK(refusal_of(begin + "\r\n") == 411);
  CHECK(refusal_of(begin + "Transfer-Encoding: chunked\r\n\r\n") == 411);
  CHECK(refusal_of(begin + "Transfer-Encoding: gzip, chunked\r\n\r\n") == 411);
  CHECK(refusal_of(begin + "Transfer-Encoding: chunked\r\nContent-Length: 4\r\n\r\n") == 400);
  CHECK(refusal_of(begin + "Content-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\n") == 400);
  CHECK(refusal_of(begin + "Content-Length: 4\r\nContent-Length: 5\r\n\r\n") == 400);
  for (const char* length : {"-1", "4 4", "0x4", "99999999999999999999", ""})
    CHECK(refusal_of(begin + "Content-Length: " + length + "\r\n\r\n") == 400);
}

TEST_CASE("A header that would be checked once and believed once is refused when it comes twice") {
  for (const std::string name : {"Host", "Authorization", "Content-Type"})
    CHECK(refusal_of("GET /events HTTP/1.1\r\n" + name + ": a\r\n" + name + ": b\r\n\r\n") == 400);
}

TEST_CASE("Input other than HTTP/1 is refused") {
  for (const std::string text :
       {"!halt\n", "GET /events\r\n\r\n", "GET /events HTTP/2.0\r\n\r\n", "PRI * HTTP/2.0\r\n\r\n",
        "GET  /events HTTP/1.1\r\n\r\n", "GET /events HTTP/1.1\nHost: a\n\n",
        "GET /events HTTP/1.1\r\nHost : a\r\n\r\n", "GET /events HTTP/1.1\r\nno colon\r\n\r\n",
        "GET /a b HTTP/1.1\r\n\r\n", "\x16\x03\x01\x02\x01\x01\xfc\x03\x03",
        "{\"jsonrpc\":\"2.0\"}\n"})
    CHECK(refusal_of(text) == 400);
}

TEST_CASE("Parameters of the query are decoded, the first of a name counts") {
  HttpRequest request;
  const std::string target =
      "/events?topics=run:*%2Crig&mode=every&x&a%20b=1+2&mode=latest&bad=%zz%2";
  REQUIRE(take(request, "GET " + target + " HTTP/1.1\r\nHost: a\r\n\r\n") == HttpStage::whole);
  CHECK(request.path() == "/events");
  CHECK(request.parameter("topics") == "run:*,rig");
  CHECK(request.parameter("mode") == "every");
  CHECK(request.parameter("x") == "");
  CHECK(request.parameter("a b") == "1 2");
  CHECK(request.parameter("bad") == "%zz%2");
  CHECK_FALSE(request.parameter("max_hz"));
}

TEST_CASE("A client that expects 100-continue is detected") {
  HttpRequest request;
  const std::string begin = "\r\nHost: a\r\nContent-Length: 4\r\nExpect: 100-Continue\r\n\r\n";
  CHECK(request.add("POST /rpc HTTP/1.1" + begin) == HttpStage::body);
  CHECK(request.awaits_continue());
  HttpRequest old;
  CHECK(old.add("POST /rpc HTTP/1.0" + begin) == HttpStage::body);
  CHECK_FALSE(old.awaits_continue());
}

TEST_CASE("Damaged requests are taken or refused alike in one piece and in many, within bounds") {
  constexpr int count = 20000;
  constexpr std::size_t most_body = 64;
  const std::string_view spare = "\r\n\r\n :%?&=+/0123456789-,;xZ\t";
  const std::string text = post_head + "{\"id\": 123}";
  std::mt19937 random(7);
  const auto below = [&](std::size_t n) { return random() % n; };
  std::map<int, int> outcomes;
  for (int i = 0; i < count; ++i) {
    std::string damaged = text;
    for (std::size_t changes = 1 + below(3); changes > 0; --changes) {
      const std::size_t at = below(damaged.size());
      const auto byte = below(2) != 0 ? spare[below(spare.size())] : static_cast<char>(below(256));
      if (below(3) == 0)
        damaged.erase(at, 1 + below(4));
      else
        damaged.replace(at, below(2), 1, byte);
    }
    HttpRequest whole({4096, most_body}), pieces({4096, most_body});
    take(whole, damaged);
    for (std::size_t at = 0, n = 0; at < damaged.size(); at += n)
      take(pieces, std::string_view(damaged).substr(at, n = 1 + below(40)));
    INFO(damaged);
    if (pieces.stage() == HttpStage::head) {  // the head is incomplete: the error may show later
      REQUIRE((whole.stage() == HttpStage::head || whole.stage() == HttpStage::refused));
      continue;
    }
    REQUIRE(pieces.stage() == whole.stage());
    REQUIRE(pieces.refusal() == whole.refusal());
    ++outcomes[whole.refusal()];
    if (whole.stage() != HttpStage::whole) continue;
    REQUIRE(pieces.body() == whole.body());
    REQUIRE(whole.body().size() <= most_body);
    REQUIRE(pieces.path() == whole.path());
  }
  std::set<int> seen;
  for (const auto& [refusal, times] : outcomes) seen.insert(refusal);
  CHECK(seen == std::set<int>{0, 400, 411, 413});
}

}  // namespace http_request_test
