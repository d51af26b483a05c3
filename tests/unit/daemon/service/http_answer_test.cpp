// Answers over HTTP: refusals before a body is read, and the position at which an event stream
// continues.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/service/rpc/event_hub.hpp"
#include "daemon/service/transport/http_answer.hpp"

namespace http_answer_test {

using namespace weft::daemon::server;
using nlohmann::json;

namespace {

std::unique_ptr<HttpRequest> request_of(const std::string& first_line, const std::string& headers) {
  auto request = std::make_unique<HttpRequest>();
  request->add(first_line + " HTTP/1.1\r\n" + headers + "\r\n");
  REQUIRE(request->stage() != HttpRequest::Stage::refused);
  return request;
}

std::string refusal_to(const std::string& first_line, const std::string& headers) {
  const auto refusal = refusal_of_head(*request_of(first_line, headers));
  return refusal ? refusal->substr(9, 3) : "none";
}

std::string continues_after(const std::string& query, const std::string& last) {
  const auto request = request_of("GET /events" + query, "Last-Event-ID: " + last + "\r\n");
  const auto seq = seen_last(*request, "e1");
  return seq ? std::to_string(*seq) : "none";
}

}  // namespace

TEST_CASE("Another Host, path, method or content type is refused by the head alone") {
  const std::string host = "Host: 127.0.0.1:8080\r\nContent-Length: 2\r\n";
  const std::string typed = host + "Content-Type: application/json; charset=utf-8\r\n";
  CHECK(refusal_to("POST /rpc", typed) == "none");
  CHECK(refusal_to("GET /events?topics=rig", "Host: localhost\r\n") == "none");
  CHECK(refusal_to("POST /rpc", host) == "415");
  CHECK(refusal_to("POST /rpc", host + "Content-Type: text/plain\r\n") == "415");
  CHECK(refusal_to("GET /rpc", "Host: localhost\r\n") == "405");
  CHECK(refusal_to("OPTIONS /rpc", "Host: localhost\r\n") == "405");
  CHECK(refusal_to("POST /events", typed) == "405");
  CHECK(refusal_to("GET /index.html", "Host: localhost\r\n") == "404");
  CHECK(refusal_to("GET /", "Host: localhost\r\n") == "none");
  CHECK(refusal_to("HEAD /", "Host: localhost\r\n") == "none");
  CHECK(refusal_to("POST /", typed) == "405");
  CHECK(refusal_to("GET /", "Host: bench.example\r\n") == "403");
  CHECK(refusal_to("GET /events", "Host: 127.0.0.1.bench.example\r\n") == "403");
  CHECK(refusal_to("GET /events", "") == "403");
}

TEST_CASE("A daemon accepts the address that it listens on as host, in brackets for IPv6") {
  const auto received = [](const std::string& host, std::string_view address) {
    return !refusal_of_head(*request_of("GET /events", "Host: " + host + "\r\n"), address);
  };
  for (const char* host : {"[::1]", "[::1]:8080", "localhost:8080", "localhost"})
    CHECK(received(host, "::1"));
  for (const char* host : {"127.0.0.2", "127.0.0.2:8080"}) CHECK(received(host, "127.0.0.2"));
  for (const char* host : {"[::1", "[::1]x", "[::2]", "::1", "[]", "[bench.example]:1"})
    CHECK_FALSE(received(host, "::1"));
  CHECK_FALSE(received("127.0.0.2", "127.0.0.1"));
  CHECK(received("bench.example", ""));  // under TLS
}

TEST_CASE("An answer has its length and ends the connection") {
  const std::string text = answer_text(200, "{}");
  CHECK(text.starts_with("HTTP/1.1 200 OK\r\n"));
  CHECK(text.find("Content-Length: 3\r\n") != std::string::npos);
  CHECK(text.find("Connection: close\r\n") != std::string::npos);
  CHECK(text.ends_with("\r\n\r\n{}\n"));
  CHECK(answer_text(204, {}).find("Content-Length") == std::string::npos);
  CHECK(too_many_text("calls", 4, "").find("Retry-After: 1\r\n") != std::string::npos);
}

TEST_CASE("A stream goes on after what its client saw last, in this start of the daemon") {
  CHECK(continues_after("?mode=every", "e1-7") == "7");
  CHECK(continues_after("?mode=every", "e1-0") == "0");
  for (const std::string last :
       {"e2-7", "e1", "e1-", "e1--7", "e1-7x", "e1-99999999999999999999", "7"})
    CHECK(continues_after("?mode=every", last) == "none");
}

TEST_CASE("The latest state is sent again: merged events have no resume point") {
  Hub hub;
  const Opened opened = hub.open({{"*"}, Mode::latest, 0});
  hub.publish("run:1", {{"state", "running"}}, 0);  // 1, merged with 3
  hub.publish("run:2", {{"rep", 1}}, 0);
  hub.publish("run:1", {{"rep", 2}}, 0);
  const json first = json::parse(opened.subscription->take({}));
  REQUIRE(first["seq"] == 2);
  const auto replayed = hub.replay({{"*"}, Mode::every, 0}, 2);  // it does not include the running
                                                                 // state of run:1
  REQUIRE(replayed);
  CHECK(json::parse(replayed->subscription->take({}))["delta"] == json{{"rep", 2}});
  CHECK(replayed->subscription->take({}).empty());
  CHECK(continues_after("", "e1-2") == "none");
  CHECK(continues_after("?mode=latest", "e1-2") == "none");
}

TEST_CASE("The line that opens a replay leaves its client where it was") {
  const std::string line =
      R"({"jsonrpc":"2.0","id":"sub","result":{"sub":"u1","seq":6,"snapshot":{}}})";
  CHECK(event_text(line, "e1", 2).starts_with("id: e1-2\nevent: snapshot\ndata: {"));
  CHECK(event_text(line, "e1").starts_with("id: e1-6\nevent: snapshot\ndata: {"));
  const std::string event = R"({"jsonrpc":"2.0","method":"event","params":{"seq":3,"delta":{}}})";
  CHECK(event_text(event, "e1") == "id: e1-3\nevent: event\ndata: {\"delta\":{},\"seq\":3}\n\n");
}

TEST_CASE("A rate that is no number reaches the method as text, which refuses it") {
  const auto requested = [](const std::string& rate) {
    const auto request = request_of("GET /events?max_hz=" + rate + "&topics=rig,run:*", "");
    const json line = json::parse(subscribe_line(*request, std::nullopt));
    CHECK(line["params"]["topics"] == json{"rig", "run:*"});
    return line["params"]["max_hz"];
  };
  CHECK(requested("2.5") == 2.5);
  CHECK(requested("[[[[").is_string());
  CHECK(requested("2,").is_string());
  CHECK(requested("nan").is_null());
}

}  // namespace http_answer_test
