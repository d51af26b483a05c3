// A program's end of the daemon's socket, and the commands' use of the answers, against a daemon
// with prepared answers.

#include "daemon/service/client/client.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>

#include "daemon/apps/weft/daemon_call.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace client_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::TemporaryFolder;

namespace {

json refusal(const std::string& kind, const std::string& message) {
  return {{"error", {{"code", 2001}, {"message", message}, {"data", {{"kind", kind}}}}}};
}

/// Answers one client on `folder`/sock. `reply` gives {"result": ...} or {"error": ...}, or
/// {"last": LINE}, which is sent unchanged before it closes the connection.
class RepliedByHand {
 public:
  using Reply = std::function<json(const std::string& method, const json& params)>;
  RepliedByHand(const TemporaryFolder& folder, Reply reply)
      : path_(folder / "sock"), reply_(std::move(reply)) {
    listener_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    const std::string name = path_.string();
    REQUIRE(name.size() < sizeof at.sun_path);
    std::copy(name.begin(), name.end(), at.sun_path);
    REQUIRE(::bind(listener_, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0);
    REQUIRE(::listen(listener_, 1) == 0);
    thread_ = std::jthread([this] { serve(); });
  }
  RepliedByHand(const RepliedByHand&) = delete;
  RepliedByHand& operator=(const RepliedByHand&) = delete;
  ~RepliedByHand() { ::close(listener_); }

  client::Client client() {
    auto opened = client::Client::open(path_);
    if (!opened) FAIL(to_string(opened.error()));
    return std::move(*opened);
  }

 private:
  void serve() const {
    const int wire = ::accept(listener_, nullptr, nullptr);
    send(wire, {{"method", "hello"}});
    std::string held;
    for (bool on = true; on;) {
      char bytes[4096];
      const ssize_t count = ::read(wire, bytes, sizeof bytes);
      if (count <= 0) break;
      held.append(bytes, static_cast<std::size_t>(count));
      for (std::size_t end = 0; on && (end = held.find('\n')) != std::string::npos;) {
        on = answer(wire, json::parse(held.substr(0, end)));
        held.erase(0, end + 1);
      }
    }
    ::close(wire);
  }
  bool answer(int wire, const json& request) const {
    const std::string method = request.at("method");
    json line = method == "session.open" ? json{{"result", json::object()}}
                                         : reply_(method, request.at("params"));
    const json last = line.value("last", json());
    line.erase("last");
    line["id"] = request.at("id");
    if (line.size() > 1) send(wire, line);
    if (!last.is_null()) send(wire, last);
    return last.is_null();
  }
  static void send(int wire, const json& message) {
    const std::string line = message.dump() + "\n";
    static_cast<void>(::send(wire, line.data(), line.size(), MSG_NOSIGNAL));
  }

  std::filesystem::path path_;
  Reply reply_;
  int listener_ = -1;
  std::jthread thread_;
};

}  // namespace

TEST_CASE("a change is answered by what the daemon did, also where its lease was over meanwhile") {
  const TemporaryFolder folder;
  std::vector<std::string> received;
  std::int64_t ttl_ms = 0;
  RepliedByHand daemon(folder, [&](const std::string& method, const json& params) -> json {
    received.push_back(method);
    if (method == "lease.acquire") {
      ttl_ms = params.at("ttl_ms");
      return {{"result", {{"lease", "L-e-1"}}}};
    }
    if (method == "run.recover") return {{"result", {{"lease", params.at("lease")}}}};
    return refusal("not_found", "no such lease, or its time is over");
  });
  client::Client client = daemon.client();
  const auto run =
      cli::under_lease(client, {"a test", std::chrono::minutes(2)}, "run.recover", json::object());
  REQUIRE(run);
  CHECK(run->at("lease") == "L-e-1");
  CHECK(ttl_ms == 120'000);
  CHECK(received == std::vector<std::string>{"lease.acquire", "run.recover", "lease.release"});
}

TEST_CASE("a refused change is reported as refused, and its lease is released") {
  const TemporaryFolder folder;
  std::vector<std::string> received;
  RepliedByHand daemon(folder, [&](const std::string& method, const json&) -> json {
    received.push_back(method);
    if (method == "run.start") return refusal("state.conflict", "not now");
    return {{"result", {{"lease", "L-e-1"}}}};
  });
  client::Client client = daemon.client();
  const auto run = cli::under_lease(client, {"a test"}, "run.start", json::object());
  REQUIRE_FALSE(run);
  CHECK(run.error().what == "not now");
  CHECK(client.refusal() == "state.conflict");
  CHECK(received.back() == "lease.release");
}

TEST_CASE("a change goes under a lease of one's own that no connection keeps, as the page's") {
  const TemporaryFolder folder;
  bool is_there = false;
  RepliedByHand daemon(folder, [&](const std::string& method, const json& params) -> json {
    if (method == "lease.acquire") return refusal("state.conflict", "rig:bench is leased");
    if (method == "session.whoami") return {{"result", {{"user", "ada"}}}};
    if (method == "lease.list")
      return {{"result",
               {{"leases",
                 {{{"lease", "L-e-1"}, {"user", "token:ada"}, {"session", "h-1"}},
                  {{"lease", "L-e-2"}, {"user", "ada"}, {"session", "h-2"}}}}}}};
    if (method == "session.list")
      return {{"result", {{"sessions", {{{"session", is_there ? "h-2" : "s-9"}}}}}}};
    if (!params.contains("lease")) return refusal("lease.required", "no such lease");
    return {{"result", {{"lease", params.at("lease")}}}};
  });
  client::Client client = daemon.client();
  const auto run = cli::under_lease(client, {"a test"}, "run.start", json::object());
  REQUIRE(run);
  CHECK(run->at("lease") == "L-e-2");
  is_there = true;  // a program of this user has the lease
  const auto kept_out = cli::under_lease(client, {"a test"}, "run.start", json::object());
  REQUIRE_FALSE(kept_out);
  CHECK(kept_out.error().what == "rig:bench is leased");
}

TEST_CASE("the last message of a daemon that ends a connection is the error of the client") {
  const std::string over = "the time of this token is over, or it was removed";
  json last = refusal("access.token", over);
  last["id"] = nullptr;
  const TemporaryFolder folder;
  RepliedByHand daemon(folder, [&](const std::string& method, const json&) -> json {
    if (method == "sub.open") return {{"result", json::object()}, {"last", last}};
    return {{"last", last}};
  });
  SECTION("while it waits for an answer") {
    client::Client client = daemon.client();
    const auto waited = client.call("run.wait");
    REQUIRE_FALSE(waited);
    CHECK(waited.error().what == over);
  }
  SECTION("while it waits for an event") {
    client::Client client = daemon.client();
    REQUIRE(client.call("sub.open"));
    const auto event = client.next_event();
    REQUIRE_FALSE(event);
    CHECK(event.error().what == over);
  }
}

}  // namespace client_test
