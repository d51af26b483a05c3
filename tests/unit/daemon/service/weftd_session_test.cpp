// One client's session with the daemon's own methods: refusals, and requests that are never
// refused.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/unit/daemon/service/weftd_talk.hpp"

namespace weftd_session_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::server;
using nlohmann::json;
using test::introduction;
using test::Talk;
using test::TemporaryFolder;

TEST_CASE("A stop is done while as many calls wait for their answers as may") {
  Talk talk;
  REQUIRE(talk.query("session.open", introduction()).contains("result"));
  for (std::size_t i = 0; i < Session::most_pending; ++i) talk.query("later.say");
  REQUIRE(talk.kind_of(talk.query("system.time")) == "request.too_many");
  CHECK(talk.query("rig.halt").at("result").at("latched") == true);
  CHECK(talk.query("rig.estop").at("result").at("latch") == "estop");
  for (const char* order : {"run.pause", "run.stop", "run.abort"})
    CHECK(talk.kind_of(talk.query(order, {{"run", "R-000009"}})) ==
          "not_found");  // and not request.too_many
  CHECK(talk.query("rig.state").contains("result"));
}

TEST_CASE("A stop with invalid parameters is executed, and the answer has warnings") {
  Talk talk;
  REQUIRE(talk.query("session.open", introduction()).contains("result"));
  const auto warned = [&](const std::string& line) {
    const json answer = talk.on_message(line);
    INFO(line << " -> " << answer);
    CHECK(talk.is_latched());
    talk.reset();
    REQUIRE(answer.at("result").at("latched") == true);
    std::vector<std::string> kinds;
    for (const json& warning : answer["result"].value("warnings", json::array()))
      kinds.push_back(warning.at("data").at("kind"));
    return kinds;
  };
  const auto with = [](const std::string& params) {
    return R"({"jsonrpc":"2.0","id":1,"method":"rig.halt","params":)" + params + "}";
  };
  using Kinds = std::vector<std::string>;
  CHECK(warned(with("{}")).empty());
  CHECK(warned(with(R"({"reason":"smoke","idem":"k"})")).empty());
  CHECK(warned(with(R"({"reason":"smoke","idem":"k"})")).empty());  // with a key it halts each time
  CHECK(warned(with(R"({"raeson":"smoke"})")) == Kinds{"param.unknown"});
  CHECK(warned(with(R"({"reason":7,"x":1})")) == Kinds{"param.type", "param.unknown"});
  CHECK(warned(with(R"({"reason":")" + std::string(5000, 'x') + "\"}")) == Kinds{"param.range"});
  CHECK(warned(with("[1]")) == Kinds{"param.type"});
  CHECK(warned(R"({"jsonrpc":"2.0","id":1,"method":"rig.halt","parmas":{}})") ==
        Kinds{"request.unknown_member"});
  CHECK(warned(R"({"method":"rig.estop"})") == Kinds{"request.invalid"});
  CHECK(talk.lines().at(2).payload_json == R"({"reason":"smoke"})");
}

TEST_CASE("A rig file that weft check refuses blocks the start of runs, and is reported") {
  Talk talk;
  const auto blockers = [&] {
    std::map<std::string, std::string> out;
    const json ready = json::parse(api::readiness_json(talk.services));
    for (const json& one : ready["blockers"]) out[one["kind"]] = one["hint"];
    return out;
  };
  CHECK(blockers().empty());
  json rig = test::bench17();
  test::device_of(rig, "wrench")["driver"] = "ati_rtd";
  test::write_file(talk.bench.request.rig, rig.dump());
  CHECK(blockers()["rig.invalid"].find("ati_rtd") != std::string::npos);
  rig = test::bench17();
  rig["simulation"]["fabrics"] = (talk.folder / "cloths.json").string();
  test::write_file(talk.bench.request.rig, rig.dump());
  CHECK(blockers().contains("rig.invalid"));
  test::write_file(talk.folder / "cloths.json", test::read_file(test::source / "sim/fabrics.json"));
  CHECK(blockers().empty());  // only the table is another one
  const auto plugins = talk.folder / "plugins";
  rig["plugins"] = {plugins.string()};
  test::write_file(talk.bench.request.rig, rig.dump());
  CHECK(blockers()["rig.invalid"].find(plugins.string()) != std::string::npos);
  std::filesystem::create_directory(plugins);
  CHECK(blockers().empty());
  test::device_of(rig, "wrench")["driver"] = "newcomer";
  test::write_file(talk.bench.request.rig, rig.dump());
  CHECK(blockers()["rig.invalid"].find("newcomer") != std::string::npos);
  test::write_file(plugins / "weft-driver-newcomer.so", "");
  CHECK(blockers().empty());
  std::filesystem::remove_all(plugins);
  CHECK(blockers().contains("rig.invalid"));
}

TEST_CASE("A removed data folder is reported, and nothing starts") {
  Talk talk;
  REQUIRE(talk.query("session.open", introduction()).contains("result"));
  const auto lease = talk.query("lease.acquire").at("result").at("lease").get<std::string>();
  const std::string runs = talk.bench.submit().stored.id();
  const std::string waits = talk.bench.submit().stored.id();
  const auto state_of = [&](const std::string& run) {
    return talk.bench.manager->get(run)->machine.state;
  };
  REQUIRE(talk.bench.posted.run_until([&] { return state_of(runs) == runs::RunState::running; }));
  const auto file = talk.folder / "weftd.sqlite", away = talk.folder / "away.sqlite";
  const auto move = [](const auto& from, const auto& to) {
    for (const char* part : {"", "-wal", "-shm"})
      if (std::filesystem::exists(from.string() + part))
        std::filesystem::rename(from.string() + part, to.string() + part);
  };
  move(file, away);
  const json ready = json::parse(api::readiness_json(talk.services));
  CHECK(ready["ok"] == false);
  CHECK(ready["blockers"][0]["kind"] == "storage.gone");
  const json recipe{{"recipe", "recipe"}, {"lease", lease}};
  for (const auto& [method, params] :
       {std::pair("run.start", recipe), std::pair("queue.add", recipe),
        std::pair("queue.pause", json::object())}) {
    const json refused = talk.query(method, params);
    INFO(refused);
    CHECK_THAT(refused.at("error").at("data").at("where").get<std::string>(),
               Catch::Contains("weftd.sqlite"));
  }
  CHECK(talk.bench.ended(runs).stored.outcome == "complete");
  talk.bench.manager->tick();
  CHECK(state_of(waits) == runs::RunState::queued);
  move(away, file);
  CHECK(talk.query("queue.list").at("result").at("paused_by") == "auto:disk");
  talk.bench.manager->tick();
  CHECK(state_of(waits) == runs::RunState::queued);
  CHECK(talk.query("queue.start", {{"lease", lease}}).contains("result"));
  CHECK(talk.bench.ended(waits).stored.outcome == "complete");
}

TEST_CASE("On the local socket a stop needs no introduction, on the port it does") {
  Talk local;
  CHECK(local.query("rig.halt", {{"reason", "smoke"}}).at("result").at("latched") == true);
  CHECK(local.bench.manager->rig_state().facts().latch->why == "s-1 (ada): smoke");
  CHECK(local.kind_of(local.query("rig.state")) == "session.required");
  Talk remote(Peer{});
  CHECK(remote.kind_of(remote.query("rig.halt")) == "session.required");
  CHECK_FALSE(remote.is_latched());
}

TEST_CASE("A raw halt is heeded with spaces around it, and without its line's end") {
  Talk talk;
  for (const char* line : {"!halt ", " !halt", "\t!halt\r", "!estop  "}) {
    INFO(line);
    CHECK(talk.on_message(line).at("params").at("topic") == "rig");
    CHECK(talk.is_latched());
    talk.reset();
  }
  CHECK(talk.on_message("! halt").contains("error"));
  CHECK_FALSE(talk.client->on_unfinished_message("!hal"));
  CHECK_FALSE(talk.client->on_unfinished_message(R"({"jsonrpc":"2.0","method":"rig.halt"})"));
  CHECK_FALSE(talk.is_latched());
  CHECK(talk.client->on_unfinished_message(" !halt"));
  CHECK(talk.is_latched());
}

TEST_CASE("Repeated halts are counted in one line of the journal") {
  Talk talk;
  REQUIRE(talk.query("session.open", introduction()).contains("result"));
  for (int i = 0; i < 3000; ++i) REQUIRE(talk.query("rig.halt").contains("result"));
  REQUIRE(talk.lines().size() == 1);
  talk.query("rig.halt", {{"reason", "smoke"}});
  CHECK(talk.lines().size() == 2);
  talk.reset();
  const auto lines = talk.lines();
  REQUIRE(lines.size() == 4);
  CHECK(lines[2].kind == "halt");
  CHECK(json::parse(lines[2].payload_json) == json{{"repeated", 2999}});
  CHECK(lines[3].kind == "reset");
}

TEST_CASE("A client gets the supported ones of its requested features") {
  const auto features = [](const json& params) {
    Talk talk;
    json requested = introduction();
    requested.update(params);
    return talk.query("session.open", requested).at("result").at("features");
  };
  CHECK(features(json::object()) == json{"every-mode", "replay"});
  CHECK(features({{"want", {"replay", "time-travel", 7}}}) == json{"replay"});
  CHECK(features({{"want", json::array()}}) == json::array());
}

TEST_CASE("A few wrong tokens end a connection, and a right one is no user of the machine") {
  Talk talk(Peer{});
  for (std::size_t i = 1; i <= Session::most_wrong_tokens; ++i) {
    CHECK_FALSE(talk.client->over());
    CHECK(talk.kind_of(talk.query("session.open", {{"client", "x"}, {"token", "bad"}})) ==
          "access.token");
    CHECK(talk.client->wrong_tokens() == i);
  }
  REQUIRE(talk.client->over());
  CHECK(talk.client->over()->kind == "access.token");
}

TEST_CASE("From an address that guesses tokens a valid one serves stops only, for a while") {
  Talk talk(Peer{.address = "192.0.2.7"});
  for (std::size_t i = 0; i < access::RefusedTokens::most_in_window; ++i)
    talk.shared.refused_tokens.add("192.0.2.7", talk.now);
  CHECK(talk.kind_of(talk.query("session.open", {{"client", "x"}, {"token", "bad"}})) ==
        "access.limited");
  CHECK(talk.client->over());
  REQUIRE(talk.query("session.open", {{"client", "x"}, {"token", "good"}}).contains("result"));
  CHECK(talk.kind_of(talk.query("lease.list")) == "access.limited");
  CHECK(talk.query("rig.halt").contains("result"));
  talk.now += access::RefusedTokens::window;
  CHECK(talk.query("lease.list").contains("result"));
}

TEST_CASE("A client over the rate limit is refused for a while, and can always stop") {
  Talk talk(Peer{});
  REQUIRE(talk.query("session.open", {{"client", "x"}, {"token", "good"}}).contains("result"));
  for (std::size_t i = 0; i < access::RateLimits::burst; ++i) talk.query("lease.list");
  CHECK(talk.kind_of(talk.query("lease.list")) == "request.too_fast");
  CHECK(talk.query("rig.halt").contains("result"));
  talk.now += std::chrono::milliseconds(1);
  CHECK(talk.query("lease.list").contains("result"));
}

}  // namespace weftd_session_test
