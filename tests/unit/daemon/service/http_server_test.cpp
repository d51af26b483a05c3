// The HTTP server on a loop of the test, with short times and few places.

#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/write.hpp>
#include <catch2/catch.hpp>
#include <list>
#include <nlohmann/json.hpp>

#include "daemon/service/methods/services.hpp"
#include "daemon/service/transport/http_server.hpp"
#include "tests/unit/daemon/benches/kill_points.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace http_server_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::server;
using namespace std::chrono_literals;
using asio::ip::tcp;

namespace {

/// A client that reads only when the test lets it.
struct WebClient {
  explicit WebClient(asio::io_context& context) : socket(context) {}
  void read() {
    socket.async_read_some(asio::buffer(piece),
                           [this](const asio::error_code& error, std::size_t n) {
                             got.append(piece.data(), n);
                             ended = bool(error);
                             if (!ended) read();
                           });
  }
  void send(std::string text) {
    out.push_back(std::move(text));
    asio::async_write(socket, asio::buffer(out.back()),
                      [this](const asio::error_code& error, std::size_t) {
                        sent = true;
                        cut_off = bool(error);
                      });
  }
  [[nodiscard]] int status() const { return got.size() < 12 ? 0 : std::stoi(got.substr(9, 3)); }

  tcp::socket socket;
  std::array<char, 4096> piece{};
  std::list<std::string> out;
  std::string got;
  bool ended = false, sent = false, cut_off = false;
};

struct WebBench {
  explicit WebBench(const HttpLimits& limits = {}) {
    services.hub = &hub;
    services.epoch = "e1";
    shared = {&methods, &hub, &answered, "e1", {}, {}, {}, [] { return Clock(); }};
    shared.token_owner = [](std::string_view token) -> Result<TokenOwner> {
      if (token == "good") return TokenOwner{"somebody", access::Role::operator_};
      return fail({.code = Errc::wrong_state, .what = "no good"});
    };
    shared.readiness_json = [] { return std::string("{}"); };
    methods.add({"now.say", "", {}, {}, {}, ""},
                [](const rpc::Call&) -> rpc::Outcome { return "\"now\""; });
    methods.add({"later.say", "", {}, {}, {}, ""},
                rpc::Handler([this](const rpc::Call&, const rpc::Responder& respond) {
                  waiting.push_back(respond);
                }));
    api::add_subscription_methods(methods, services);
    auto opened = HttpServer::open(there, {}, shared, limits);
    REQUIRE(opened);
    server = std::move(*opened);
  }

  WebClient& connect(bool reads = true) {
    WebClient& made = clients.emplace_back(here);
    made.socket.connect({asio::ip::address_v4::loopback(), server->port()});
    if (reads) made.read();
    return made;
  }
  WebClient& query(const std::string& first_line, const std::string& body, bool reads = true) {
    WebClient& made = connect(reads);
    made.send(first_line + " HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer good\r\n" +
              "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) +
              "\r\n\r\n" + body);
    return made;
  }
  WebClient& call(const std::string& method) {
    return query("POST /rpc", R"({"jsonrpc":"2.0","id":1,"method":")" + method + "\"}");
  }
  WebClient& stream(bool reads = true) {
    return query("GET /events?mode=every&topics=*", "", reads);
  }

  /// Lets both sides work; the suite's time-out ends an endless wait.
  template <class Done>
  void until(const Done& done) {
    while (!done()) {
      there.poll();
      if (server) server->pump();
      here.poll();
      here.restart();  // it stops when there is no work
    }
  }
  int status_of(WebClient& client) {
    until([&] { return client.ended; });
    return client.status();
  }

  Hub hub;
  rpc::Methods methods;
  access::IdempotencyCache answered;
  api::Services services;
  Shared shared;
  std::vector<rpc::Responder> waiting;
  asio::io_context there{1}, here{1};
  std::list<WebClient> clients;
  std::unique_ptr<HttpServer> server;
};

}  // namespace

TEST_CASE("A method that answers later is waited for, and its answer is the connection's end") {
  WebBench bench;
  CHECK(bench.status_of(bench.call("now.say")) == 200);
  WebClient& client = bench.call("later.say");
  bench.until([&] { return !bench.waiting.empty(); });
  CHECK(client.got.empty());
  bench.waiting.front()("\"then\"");
  CHECK(bench.status_of(client) == 200);
  CHECK(client.got.ends_with(R"("result":"then"})"
                             "\n"));
}

TEST_CASE("A call without answer in time gets an error, and so does an incomplete request") {
  HttpLimits limits;
  limits.answer = 0s;
  WebBench impatient(limits);
  CHECK(impatient.status_of(impatient.call("later.say")) == 504);
  limits.request = 0s;
  WebBench hasty(limits);
  CHECK(hasty.status_of(hasty.connect()) == 408);
}

TEST_CASE("A client that disconnects while waiting frees its slot, and its answer is dropped") {
  HttpLimits limits;
  limits.waiting = 1;
  WebBench bench(limits);
  WebClient& gone = bench.call("later.say");
  bench.until([&] { return bench.waiting.size() == 1; });
  CHECK(bench.status_of(bench.call("later.say")) == 503);
  CHECK(bench.status_of(bench.call("now.say")) == 200);
  gone.socket.close();
  bench.until([&] { return gone.ended; });
  while (bench.waiting.size() == 1) {
    WebClient& next = bench.call("later.say");
    bench.until([&] { return next.ended || bench.waiting.size() == 2; });
  }
  bench.waiting.front()("\"too late\"");
  CHECK(bench.status_of(bench.call("now.say")) == 200);
}

TEST_CASE("The oldest connection without a request makes room for a new one") {
  HttpLimits limits;
  limits.brief = 2;
  WebBench bench(limits);
  WebClient &first = bench.connect(), &second = bench.connect();
  CHECK(bench.status_of(bench.call("now.say")) == 200);
  CHECK(first.ended);
  CHECK(first.got.empty());
  CHECK_FALSE(second.ended);
}

TEST_CASE(
    "A stream begins with its snapshot, has every event after it, and a sign of life between") {
  HttpLimits limits;
  limits.heartbeat = 1ms;
  WebBench bench(limits);
  bench.hub.publish("rig", {{"rig", "safe"}}, 0);
  WebClient& client = bench.stream();
  bench.until([&] { return client.got.find("\n\n:\n\n") != std::string::npos; });
  bench.hub.publish("rig", {{"rig", "latched"}}, 0);
  bench.until([&] { return client.got.find("latched") != std::string::npos; });
  CHECK(client.status() == 200);
  const auto at = [&](const char* text) { return client.got.find(text); };
  CHECK(at("id: e1-1\nevent: snapshot") < at("id: e1-2\nevent: event"));
  CHECK_FALSE(client.ended);
}

TEST_CASE("An unread stream is closed and its slot is free") {
  HttpLimits limits;
  limits.streams = 1;
  limits.unread = 0s;  // as soon as a write must wait
  WebBench bench(limits);
  bench.stream(false);
  const std::string filler(60000, 'x');
  int status = 503;
  while (status == 503) {
    for (int i = 0; i < 100; ++i) bench.hub.publish("rig", {{"filler", filler}}, 0);
    WebClient& next = bench.stream();
    bench.until([&] { return next.got.size() > 100; });
    status = next.status();
  }
  CHECK(status == 200);
}

TEST_CASE("A stream, and a call that waits, end with the token that they came with") {
  WebBench bench;
  bool token_valid = true;
  bench.shared.is_token_valid = [&](const TokenOwner&) { return token_valid; };
  WebClient& stream = bench.stream();
  WebClient& waiting = bench.call("later.say");
  bench.until([&] { return stream.status() == 200 && !bench.waiting.empty(); });
  bench.hub.publish("run:R-000001", {{"state", "running"}}, 1);
  bench.until([&] { return stream.got.find("event: event") != std::string::npos; });
  token_valid = false;
  CHECK(bench.status_of(waiting) == 401);
  bench.until([&] { return stream.ended; });
  CHECK(stream.got.find("event: error\ndata: {") != std::string::npos);
  CHECK(stream.got.find("access.token") != std::string::npos);
  bench.waiting.front()("\"nobody hears it\"");
}

TEST_CASE("A refused client that keeps sending is read for a limited time") {
  WebBench bench;
  WebClient& client = bench.connect();
  client.send("POST /rpc HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n");
  bench.until([&] { return client.got.ends_with("}\n"); });
  CHECK(client.status() == 411);
  client.sent = false;
  client.send(std::string(std::size_t{64} << 20, 'x'));
  bench.until([&] { return client.sent; });
  CHECK(client.cut_off);
}

TEST_CASE("When the daemon ends, waiting calls get an error and streams end") {
  WebBench bench;
  WebClient &waits = bench.call("later.say"), &listens = bench.stream(), &idle = bench.connect();
  bench.until([&] { return !bench.waiting.empty() && listens.got.ends_with("\n\n"); });
  bench.server.reset();
  bench.until([&] { return waits.ended && listens.ended && idle.ended; });
  CHECK(waits.status() == 503);
  CHECK(listens.status() == 200);
  CHECK(idle.got.empty());
}

TEST_CASE("A file is looked at before it is sent; one that is written to meanwhile is cut off") {
  const test::TemporaryFolder folder;
  const std::string text(8'000'000, 'x');
  test::write_file(folder / "f", text);
  WebBench bench;
  std::vector<Shared::FileCallback> requested;
  bench.shared.file = [&](std::string_view path, const Shared::FileCallback& reported) {
    CHECK(path == "R-000001/f");
    requested.push_back(reported);
  };
  const auto served = [&]() -> Result<ServedFile> {
    auto file = OpenFile::beneath(folder.path(), "f");
    REQUIRE(file);
    const auto as_of = file->stamp().value();
    return ServedFile{std::make_shared<const OpenFile>(std::move(*file)), as_of, "abc"};
  };
  const std::string get = "GET /data/R-000001/f";
  WebClient& whole = bench.query(get, "");
  bench.until([&] { return requested.size() == 1; });
  CHECK(bench.status_of(bench.call("now.say")) == 200);  // no client waits for it
  requested[0](served());
  CHECK(bench.status_of(whole) == 200);
  CHECK(whole.got.size() > text.size());

  WebClient& cut = bench.query(get, "", false);  // reads nothing yet
  bench.until([&] { return requested.size() == 2; });
  requested[1](served());
  for (int i = 0; i < 100; ++i) bench.there.poll();  // fills the socket's buffer
  test::write_file(folder / "f", std::string(text.size(), 'y'));
  cut.read();
  CHECK(bench.status_of(cut) == 200);
  CHECK(cut.got.size() < text.size());
  CHECK(cut.got.find('y', cut.got.find("\r\n\r\n")) == std::string::npos);

  WebClient& refused = bench.query(get, "");
  bench.until([&] { return requested.size() == 3; });
  requested[2](fail({.code = Errc::wrong_state, .what = "altered"}));
  CHECK(bench.status_of(refused) == 409);
  WebClient& busy = bench.query(get, "");
  bench.until([&] { return requested.size() == 4; });
  requested[3](fail({.code = Errc::timeout, .what = "later"}));
  CHECK(bench.status_of(busy) == 503);
  {
    WebClient& gone = bench.query(get, "");
    bench.until([&] { return requested.size() == 5; });
    gone.socket.close();
  }
  requested[4](served());  // the client has gone
}

TEST_CASE("The page needs no token, what it shows does") {
  WebBench bench;
  const auto requested = [&](const std::string& path) {
    WebClient& client = bench.connect();
    client.send("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
    return bench.status_of(client);
  };
  CHECK(requested("/") == 200);
  CHECK(requested("/style.css") == 200);
  CHECK(requested("/events") == 401);
  CHECK(requested("/nothing") == 404);
}

}  // namespace http_server_test
