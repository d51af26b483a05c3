// The socket server with clients of the test, on its Unix socket and on TCP.

#include "daemon/service/transport/socket_server.hpp"

#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/local/stream_protocol.hpp>
#include <asio/read_until.hpp>
#include <asio/write.hpp>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <thread>

#include "daemon/service/methods/helpers.hpp"
#include "daemon/service/rpc/worker_queue.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace socket_server_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::server;
using nlohmann::json;
using test::TemporaryFolder;

namespace {

/// A client that waits for each line; the suite's time-out ends an endless wait.
template <class Socket>
struct LineClient {
  asio::io_context context{1};
  Socket socket{context};
  std::string held;

  template <class Place>
  explicit LineClient(const Place& place) {
    socket.connect(place);
  }
  void send(const std::string& lines) { asio::write(socket, asio::buffer(lines + "\n")); }
  /// Empty if the server has closed the connection.
  std::optional<json> read() {
    asio::error_code error;
    const std::size_t size = asio::read_until(socket, asio::dynamic_buffer(held), '\n', error);
    if (error) return std::nullopt;
    const json line = json::parse(held.substr(0, size));
    held.erase(0, size);
    return line;
  }
  json query(const std::string& method, const std::string& params = "{}") {
    send(R"({"jsonrpc":"2.0","id":1,"method":")" + method + R"(","params":)" + params + "}");
    return read().value_or("closed");
  }
};
using Unix = asio::local::stream_protocol;
using Local = LineClient<Unix::socket>;
using Remote = LineClient<asio::ip::tcp::socket>;

/// Runs on its own thread, as in weftd; members are read after it has ended.
struct SocketBench {
  explicit SocketBench(const Limits& most = {}) {
    shared = {&methods, &hub, &answered, "e1", {}, {}, {}, [] { return Clock(); }};
    shared.token_owner = [](std::string_view) -> Result<TokenOwner> {
      return TokenOwner{"somebody", access::Role::operator_};
    };
    shared.readiness_json = [] { return std::string("{}"); };
    shared.halt = [this](const rpc::Caller&) { happened.emplace_back("halt"); };
    add_session_open(methods);
    auto opened = SocketServer::open({folder / "s.sock", std::uint16_t{0}}, shared, most);
    REQUIRE(opened);
    server = std::move(*opened);
  }
  ~SocketBench() { end(); }
  void begin() {
    thread = std::jthread([this] { server->run([] {}); });
  }
  void end() {
    if (!thread.joinable()) return;
    server->stop();
    thread.join();
  }
  Unix::endpoint place() const { return Unix::endpoint((folder / "s.sock").string()); }
  asio::ip::tcp::endpoint port() const {
    return {asio::ip::address_v4::loopback(), server->port()};
  }

  TemporaryFolder folder;
  Hub hub;
  rpc::Methods methods;
  access::IdempotencyCache answered;
  Shared shared;
  std::vector<std::string> happened;
  std::unique_ptr<SocketServer> server;
  std::jthread thread;
};

const std::string open_params = R"({"client":"test","token":"any"})";

}  // namespace

TEST_CASE("Lines that came together are worked off in turn with whatever else has come") {
  SocketBench bench;
  bench.methods.add({"now.say", "", {}, {}, {}, ""}, [&](const rpc::Call&) -> rpc::Outcome {
    bench.happened.emplace_back("line");
    bench.server->post([&] { bench.happened.emplace_back("another's"); });
    return "1";
  });
  bench.begin();
  Local client(bench.place());
  REQUIRE(client.read());
  REQUIRE(client.query("session.open", open_params).contains("result"));
  const std::string call = R"({"jsonrpc":"2.0","id":1,"method":"now.say"})";
  client.send(call + "\n" + call + "\n" + call);
  for (int i = 0; i < 3; ++i) REQUIRE(client.read());
  REQUIRE(client.query("session.whoami").contains("error"));  // everything before it has been done
  bench.end();
  CHECK(bench.happened ==
        std::vector<std::string>{"line", "another's", "line", "another's", "line", "another's"});
}

TEST_CASE("A halt is answered while an errand of another client is under way") {
  SocketBench bench;
  std::mutex under_way;
  WorkerQueue workers([&](WorkerQueue::Report report) { bench.server->post(std::move(report)); });
  bench.methods.add({"later.say", "", {}, {}, {}, ""},
                    rpc::Handler([&](const rpc::Call&, const rpc::Responder& respond) {
                      const bool taken = workers.send(
                          [&, respond] {
                            const std::lock_guard waits(under_way);
                            return [respond] { respond("1"); };
                          },
                          {});
                      if (!taken) respond(tl::unexpected(rpc::rpc_error(1, "full", {})));
                    }));
  std::unique_lock held(under_way);
  bench.begin();
  Local asks(bench.place()), halts(bench.place());
  REQUIRE(asks.read());
  REQUIRE(halts.read());
  REQUIRE(asks.query("session.open", open_params).contains("result"));
  constexpr std::size_t calls = WorkerQueue::most_waiting + 2;
  for (std::size_t i = 0; i < calls; ++i)
    asks.send(R"({"jsonrpc":"2.0","id":1,"method":"later.say"})");
  halts.send("!halt");
  CHECK(halts.read()->at("params").at("delta").at("latched") == "halt");
  CHECK(asks.read()->at("error").at("data").at("kind") == "full");
  held.unlock();
  for (std::size_t i = 1; i + 1 < calls; ++i) CHECK(asks.read());
  bench.end();
  CHECK(bench.happened == std::vector<std::string>{"halt"});
}

TEST_CASE("A task that throws gets an error, and later tasks are done") {
  SocketBench bench;
  WorkerQueue workers([&](WorkerQueue::Report report) { bench.server->post(std::move(report)); });
  const auto add = [&](const char* name, const std::function<rpc::Outcome()>& work) {
    bench.methods.add({name, "", {}, {}, {}, ""},
                      rpc::Handler([&, work](const rpc::Call&, const rpc::Responder& respond) {
                        const auto send = [&](WorkerQueue::Work sent, WorkerQueue::Failed failed) {
                          return workers.send(std::move(sent), std::move(failed));
                        };
                        api::answer_in_background(send, respond, work);
                      }));
  };
  add("throw.late", []() -> rpc::Outcome { throw std::bad_alloc(); });
  add("throw.number", []() -> rpc::Outcome { throw 7; });
  add("now.say", []() -> rpc::Outcome { return "1"; });
  bench.begin();
  Local client(bench.place());
  REQUIRE(client.read());
  REQUIRE(client.query("session.open", open_params).contains("result"));
  CHECK(client.query("throw.late").at("error").at("data").at("kind") == "internal");
  CHECK(client.query("throw.number").at("error").at("data").at("kind") == "internal");
  CHECK(client.query("now.say").at("result") == 1);
}

TEST_CASE("Flooding the port with clients that open no session keeps no one out") {
  Limits most;
  most.connections = 6;
  most.unauthenticated = 4;
  most.local_connections = 2;
  SocketBench bench(most);
  bench.begin();
  Remote known(bench.port());
  REQUIRE(known.read());
  REQUIRE(known.query("session.open", open_params).contains("result"));
  std::list<Remote> silent;
  for (int i = 0; i < 20; ++i) {
    silent.emplace_back(bench.port());
    REQUIRE(silent.back().read());  // greeted: the one before has its place
  }
  CHECK_FALSE(silent.front().read());  // the oldest was closed for another
  Remote late(bench.port());
  REQUIRE(late.read());
  CHECK(late.query("session.open", open_params).contains("result"));
  Local halts(bench.place());
  REQUIRE(halts.read());
  halts.send("!halt");
  CHECK(halts.read()->at("params").at("delta").at("latched") == "halt");
  CHECK(known.query("session.open", open_params).at("error").at("data").at("kind") ==
        "session.again");
  bench.end();
  CHECK(bench.server->connections() <= most.connections + 1);
}

TEST_CASE("A socket that is full of known clients has places for stops, and for them alone") {
  Limits most;
  most.local_connections = 2;
  most.places_for_stops = 2;
  SocketBench bench(most);
  bench.methods.add({"now.say", "", {}, {}, {}, ""},
                    [](const rpc::Call&) -> rpc::Outcome { return "1"; });
  bench.methods.add(
      {"now.stop", "", {}, {}, {}, "", rpc::Memory::over_restarts, rpc::Urgency::urgent},
      [](const rpc::Call&) -> rpc::Outcome { return "2"; });
  bench.begin();
  std::list<Local> known;
  for (int i = 0; i < 2; ++i) {
    known.emplace_back(bench.place());
    REQUIRE(known.back().read());
    REQUIRE(known.back().query("session.open", open_params).contains("result"));
  }
  Local halts(bench.place()), waits(bench.place());
  REQUIRE(halts.read());
  halts.send("!halt");
  CHECK(halts.read()->at("params").at("delta").at("latched") == "halt");
  REQUIRE(waits.read());
  REQUIRE(waits.query("session.open", open_params).contains("result"));
  CHECK(waits.query("now.say").at("error").at("data").at("kind") == "server.full");
  CHECK(waits.query("now.stop").at("result") == 2);
  Local third(bench.place());
  REQUIRE(third.read());
  CHECK_FALSE(halts.read());  // the oldest of these was closed for another
  known.pop_front();
  json answer;
  for (int i = 0; i < 100'000 && !answer.contains("result"); ++i) answer = waits.query("now.say");
  CHECK(answer.at("result") == 1);  // it has the place that became free
  CHECK(known.front().query("now.say").at("result") == 1);
}

TEST_CASE("A halt line without line end is executed and answered") {
  SocketBench bench;
  bench.begin();
  Local halts(bench.place());
  REQUIRE(halts.read());
  asio::write(halts.socket, asio::buffer(std::string("!halt")));
  halts.socket.shutdown(asio::socket_base::shutdown_send);
  CHECK(halts.read()->at("params").at("delta").at("latched") == "halt");
  CHECK_FALSE(halts.read());
  bench.end();
  CHECK(bench.happened == std::vector<std::string>{"halt"});
}

TEST_CASE("Clients that are known keep their places: a full port refuses, the socket does not") {
  Limits most;
  most.connections = 2;
  most.local_connections = 1;
  SocketBench bench(most);
  bench.begin();
  std::list<Remote> known;
  for (int i = 0; i < 2; ++i) {
    known.emplace_back(bench.port());
    REQUIRE(known.back().read());
    REQUIRE(known.back().query("session.open", open_params).contains("result"));
  }
  Remote late(bench.port());
  CHECK_FALSE(late.read());
  Local local(bench.place());
  REQUIRE(local.read());
  CHECK(local.query("session.open", open_params).contains("result"));
  CHECK(known.front().query("session.open", open_params).contains("error"));
}

}  // namespace socket_server_test
