// One client's conversation with the daemon's own methods, without sockets: what is refused, and
// what is never refused.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/api/services.hpp"
#include "daemon/server/conversation.hpp"
#include "tests/unit/daemon/desk_bench.hpp"

namespace weftd_conversation_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::server;
using nlohmann::json;
using test::TemporaryFolder;

namespace {

/// A daemon whose clock is the test's, and one client of it.
struct Talk {
  explicit Talk(Peer peer = {true, "ada", access::Role::admin}) {
    services.hub = &hub;
    services.leases = &leases;
    services.desk = bench.desk.get();
    services.log = &bench.store;
    services.rig = bench.request.rig;
    services.rig_name = "bench";
    services.recipes = services.data = folder.path();
    services.now = [this] { return now; };
    services.utc_us = [] { return std::int64_t{0}; };
    services.sessions = &shared.sessions;
    services.pace = &pace;
    services.change_errand = [](const auto& work, const auto&) {
      work()();
      return true;
    };
    api::add_methods(methods, services);
    methods.add({"later.say", "", {}, {}, {}, ""},
                rpc::Handler([this](const rpc::Call&, rpc::Responder respond) {
                  unanswered.push_back(std::move(respond));
                }));
    shared.methods = &methods;
    shared.hub = &hub;
    shared.answered = &answered;
    shared.readiness_json = [this] { return api::readiness_json(services); };
    shared.now = services.now;
    shared.halt = [this](const rpc::Caller& caller) { bench.desk->halt(caller.session); };
    shared.emergency_stop = [this](const rpc::Caller& caller) {
      bench.desk->emergency_stop(caller.session);
    };
    shared.token_owner = [](std::string_view token) -> Result<TokenOwner> {
      if (token == "good") return TokenOwner{"token:ada", access::Role::operator_};
      return fail(Errc::wrong_state, "no good");
    };
    client = std::make_unique<Conversation>(
        shared, std::move(peer), "s-1",
        [this](std::string line) { said.push_back(json::parse(line)); });
  }
  json hear(const std::string& line) {
    said.clear();
    client->hear(line);
    return said.empty() ? json() : said.back();
  }
  json ask(const std::string& method, const json& params = json::object()) {
    return hear(json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", params}}.dump());
  }
  static std::string kind_of(const json& answer) {
    return answer.at("error").at("data").at("kind");
  }
  bool is_latched() const {
    return bench.desk->standing().fact == control::RigStanding::Fact::latched;
  }
  void reset() { REQUIRE(bench.desk->reset("looked at it", "test")); }
  std::vector<control::RunStore::Line> lines() { return bench.store.tail("", 10'000).value(); }

  TemporaryFolder folder;
  test::DeskBench bench{folder, test::tiny_recipe(1)};
  Clock now{};
  Hub hub;
  access::Leases leases{"e1"};
  access::IdempotencyCache answered;
  BenchPace pace = 0;
  Shared shared;
  api::Services services;
  rpc::Methods methods;
  std::vector<rpc::Responder> unanswered;
  std::vector<json> said;
  std::unique_ptr<Conversation> client;
};

const json introduction{{"client", "test"}};

}  // namespace

TEST_CASE("A stop is done while as many calls wait for their answers as may") {
  Talk talk;
  REQUIRE(talk.ask("session.open", introduction).contains("result"));
  for (std::size_t i = 0; i < Conversation::most_pending; ++i) talk.ask("later.say");
  REQUIRE(talk.kind_of(talk.ask("system.time")) == "request.too_many");
  CHECK(talk.ask("rig.halt").at("result").at("latched") == true);
  CHECK(talk.ask("rig.estop").at("result").at("latch") == "estop");
  for (const char* order : {"run.pause", "run.stop", "run.abort"})
    CHECK(talk.kind_of(talk.ask(order, {{"run", "R-000009"}})) == "not_found");  // and not too many
  CHECK(talk.ask("rig.state").contains("result"));
}

TEST_CASE("Whatever is wrong with a stop beside its name, it is done, and the answer tells") {
  Talk talk;
  REQUIRE(talk.ask("session.open", introduction).contains("result"));
  const auto warned = [&](const std::string& line) {
    const json answer = talk.hear(line);
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
  CHECK(warned(with(R"({"reason":"smoke","idem":"k"})")).empty());  // a key stops each time
  CHECK(warned(with(R"({"raeson":"smoke"})")) == Kinds{"param.unknown"});
  CHECK(warned(with(R"({"reason":7,"x":1})")) == Kinds{"param.type", "param.unknown"});
  CHECK(warned(with(R"({"reason":")" + std::string(5000, 'x') + "\"}")) == Kinds{"param.range"});
  CHECK(warned(with("[1]")) == Kinds{"param.type"});
  CHECK(warned(R"({"jsonrpc":"2.0","id":1,"method":"rig.halt","parmas":{}})") ==
        Kinds{"request.unknown_member"});
  CHECK(warned(R"({"method":"rig.estop"})") == Kinds{"request.invalid"});
  CHECK(talk.lines().at(2).payload_json == R"({"reason":"smoke"})");
}

TEST_CASE(
    "A rig file that weft check refuses keeps a run from being started, and whoever comes hears") {
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
  CHECK(blockers().empty());  // the table alone is another
}

TEST_CASE("A folder that is taken away under the daemon is told, and nothing begins") {
  Talk talk;
  REQUIRE(talk.ask("session.open", introduction).contains("result"));
  const auto lease = talk.ask("lease.acquire").at("result").at("lease").get<std::string>();
  const std::string runs = talk.bench.submit().stored.id();
  const std::string waits = talk.bench.submit().stored.id();
  const auto state_of = [&](const std::string& run) {
    return talk.bench.desk->get(run)->machine.state;
  };
  REQUIRE(
      talk.bench.posted.run_until([&] { return state_of(runs) == control::RunState::running; }));
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
    const json refused = talk.ask(method, params);
    INFO(refused);
    CHECK(refused.at("error").at("message").get<std::string>().find("not in its folder any more") !=
          std::string::npos);
  }
  CHECK(talk.bench.ended(runs).stored.outcome == "complete");
  talk.bench.desk->tick();
  CHECK(state_of(waits) == control::RunState::queued);
  move(away, file);
  CHECK(talk.ask("queue.pause").contains("result"));
  talk.bench.desk->tick();
  CHECK(state_of(waits) == control::RunState::queued);
  CHECK(talk.ask("queue.start", {{"lease", lease}}).contains("result"));
  CHECK(talk.bench.ended(waits).stored.outcome == "complete");
}

TEST_CASE("On the local socket a stop needs no introduction, on the port it does") {
  Talk local;
  CHECK(local.ask("rig.halt", {{"reason", "smoke"}}).at("result").at("latched") == true);
  CHECK(local.bench.desk->standing().why == "s-1 (ada): smoke");
  CHECK(local.kind_of(local.ask("rig.state")) == "session.required");
  Talk remote(Peer{});
  CHECK(remote.kind_of(remote.ask("rig.halt")) == "session.required");
  CHECK_FALSE(remote.is_latched());
}

TEST_CASE("A raw halt is heeded with spaces around it, and without its line's end") {
  Talk talk;
  for (const char* line : {"!halt ", " !halt", "\t!halt\r", "!estop  "}) {
    INFO(line);
    CHECK(talk.hear(line).at("params").at("topic") == "rig");
    CHECK(talk.is_latched());
    talk.reset();
  }
  CHECK(talk.hear("! halt").contains("error"));
  CHECK_FALSE(talk.client->hear_unfinished("!hal"));
  CHECK_FALSE(talk.client->hear_unfinished(R"({"jsonrpc":"2.0","method":"rig.halt"})"));
  CHECK_FALSE(talk.is_latched());
  CHECK(talk.client->hear_unfinished(" !halt"));
  CHECK(talk.is_latched());
}

TEST_CASE("Who halts again and again is counted in a line of the journal") {
  Talk talk;
  REQUIRE(talk.ask("session.open", introduction).contains("result"));
  for (int i = 0; i < 3000; ++i) REQUIRE(talk.ask("rig.halt").contains("result"));
  REQUIRE(talk.lines().size() == 1);
  talk.ask("rig.halt", {{"reason", "smoke"}});
  CHECK(talk.lines().size() == 2);
  talk.reset();
  const auto lines = talk.lines();
  REQUIRE(lines.size() == 4);
  CHECK(lines[2].kind == "halt");
  CHECK(json::parse(lines[2].payload_json) == json{{"repeated", 2999}});
  CHECK(lines[3].kind == "reset");
}

TEST_CASE("Of the features that a client wants it is told those that there are") {
  const auto features = [](const json& params) {
    Talk talk;
    json asked = introduction;
    asked.update(params);
    return talk.ask("session.open", asked).at("result").at("features");
  };
  CHECK(features(json::object()) == json{"every-mode", "replay"});
  CHECK(features({{"want", {"replay", "time-travel", 7}}}) == json{"replay"});
  CHECK(features({{"want", json::array()}}) == json::array());
}

TEST_CASE("A few wrong tokens end a connection, and a right one is no user of the machine") {
  Talk talk(Peer{});
  for (std::size_t i = 1; i <= Conversation::most_wrong_tokens; ++i) {
    CHECK_FALSE(talk.client->over());
    CHECK(talk.kind_of(talk.ask("session.open", {{"client", "x"}, {"token", "bad"}})) ==
          "access.token");
    CHECK(talk.client->wrong_tokens() == i);
  }
  REQUIRE(talk.client->over());
  CHECK(talk.client->over()->kind == "access.token");
}

TEST_CASE("Who asks too fast over the port is refused for a while, and may stop all the time") {
  Talk talk(Peer{});
  REQUIRE(talk.ask("session.open", {{"client", "x"}, {"token", "good"}}).contains("result"));
  for (std::size_t i = 0; i < access::RateLimits::burst; ++i) talk.ask("lease.list");
  CHECK(talk.kind_of(talk.ask("lease.list")) == "request.too_fast");
  CHECK(talk.ask("rig.halt").contains("result"));
  talk.now += std::chrono::milliseconds(1);
  CHECK(talk.ask("lease.list").contains("result"));
}

TEST_CASE("An answer that is longer than a line may be is refused, and says how to ask for less") {
  Talk talk;
  talk.methods.add({"much.say", "", {}, {}, {}, ""}, [](const rpc::Call&) -> rpc::Outcome {
    return "\"" + std::string(Conversation::most_answer_bytes, 'x') + "\"";
  });
  REQUIRE(talk.ask("session.open", introduction).contains("result"));
  const json answer = talk.ask("much.say");
  CHECK(talk.kind_of(answer) == "answer.too_long");
  CHECK_THAT(answer["error"]["data"]["hint"].get<std::string>(), Catch::Contains("most"));
}

TEST_CASE("The journal comes in pages that a line can hold, whole") {
  Talk talk;
  REQUIRE(talk.ask("session.open", introduction).contains("result"));
  constexpr std::size_t count = 3000;
  const std::string payload = json{{"text", std::string(900, 'x')}}.dump();
  REQUIRE(talk.bench.store.together([&]() -> Status {
    for (std::size_t i = 0; i < count; ++i)
      if (Status ok = talk.bench.store.journal(0, "", "note", "test", payload); !ok) return ok;
    return {};
  }));
  const json tail = talk.ask("log.tail", {{"most", 10'000}}).at("result");
  CHECK(tail.dump().size() < std::size_t{1100} << 10);
  CHECK(tail["lines"].size() + tail["left_off"].get<std::size_t>() == count);
  CHECK(tail["lines"].back()["sequence"] == count);
  CHECK(tail["lines"].front()["sequence"] == count - tail["lines"].size() + 1);
  std::size_t found = 0, pages = 0;
  for (json from = 1; !from.is_null(); ++pages) {
    const json page = talk.ask("log.query", {{"most", 10'000}, {"from", from}}).at("result");
    for (const json& line : page["lines"]) REQUIRE(line["sequence"] == ++found);
    from = page["next"];
  }
  CHECK(found == count);
  CHECK(pages == 3);
}

TEST_CASE("Runs are listed in pages, the oldest first") {
  Talk talk;
  REQUIRE(talk.ask("session.open", introduction).contains("result"));
  talk.bench.desk->halt("test");  // nothing begins
  for (int i = 0; i < 5; ++i) talk.bench.submit();
  const auto page = [&](const json& params) { return talk.ask("run.list", params).at("result"); };
  const json first = page({{"most", 3}});
  CHECK(first["runs"].size() == 3);
  CHECK(first["next"] == "R-000004");
  const json last = page({{"most", 3}, {"from", first["next"]}});
  REQUIRE(last["runs"].size() == 2);
  CHECK(last["runs"][0]["run"] == "R-000004");
  CHECK(last["next"].is_null());
  CHECK(page({{"state", "ended"}})["runs"].empty());
  CHECK(talk.kind_of(talk.ask("run.list", {{"most", 0}})) == "param.range");
  CHECK(talk.kind_of(talk.ask("run.list", {{"from", "R-9"}})) == "not_found");
  CHECK(talk.ask("data.list").at("result").at("next").is_null());
}

TEST_CASE("A run is told with who changed it, and who put it in line") {
  Talk talk;
  REQUIRE(talk.ask("session.open", introduction).contains("result"));
  talk.bench.desk->halt("test");
  const std::string run = talk.bench.submit().stored.id();
  CHECK(talk.ask("run.get", {{"run", run}}).at("result").at("by") == "test");
  const json gone = talk.ask("run.withdraw", {{"run", run}}).at("result");
  CHECK(gone["by"] == "s-1 (ada)");
  CHECK(gone["submitted_by"] == "test");
}

TEST_CASE("The topic of a lease is its state: who holds it, and the last that was done with it") {
  Talk talk;
  REQUIRE(talk.ask("session.open", introduction).contains("result"));
  const auto snapshot = [&] {
    return json::parse(talk.hub.open({{"lease:*"}, Mode::latest}).snapshot_json)
        .at("lease:rig:bench");
  };
  const auto has_only = [&](const char* what) {
    const json now = snapshot();
    std::size_t found = 0;
    for (const char* each : {"acquired", "renewed", "released", "broken", "expired"})
      found += now.contains(each) ? 1 : 0;
    return found == 1 && now.contains(what);
  };
  const std::string first = talk.ask("lease.acquire").at("result").at("lease");
  CHECK(has_only("acquired"));
  CHECK(snapshot()["held"]["lease"] == first);
  talk.now += std::chrono::seconds(2);
  talk.ask("lease.renew", {{"lease", first}});
  CHECK(has_only("renewed"));
  talk.ask("lease.renew", {{"lease", first}});
  talk.ask("lease.release", {{"lease", first}});
  CHECK(has_only("released"));
  CHECK_FALSE(snapshot().contains("held"));
  CHECK(snapshot()["by"] == "s-1 (ada)");
  talk.ask("lease.acquire");
  CHECK(has_only("acquired"));
  talk.now += std::chrono::hours(1);
  for (const access::Lease& lease : talk.leases.expire(talk.now))
    api::tell_expired(talk.services, lease);
  CHECK(has_only("expired"));
  CHECK(snapshot()["by"] == "auto:time");
  std::vector<std::string> kinds;
  for (const auto& line : talk.lines()) kinds.push_back(line.kind);
  CHECK(kinds == std::vector<std::string>{"lease.acquired", "lease.renewed", "lease.released",
                                          "lease.acquired", "lease.expired"});
}

TEST_CASE("Why a lease was broken is answered, told to all and kept") {
  Talk talk;
  REQUIRE(talk.ask("session.open", introduction).contains("result"));
  const std::string lease = talk.ask("lease.acquire").at("result").at("lease");
  const std::string why = "its owner has gone home";
  CHECK(talk.ask("lease.break", {{"lease", lease}, {"reason", why}}).at("result").at("reason") ==
        why);
  const json told = json::parse(talk.hub.open({{"lease:*"}, Mode::latest}).snapshot_json);
  CHECK(told.at("lease:rig:bench").at("broken").at("reason") == why);
  CHECK(talk.lines().back().kind == "lease.broken");
  CHECK(json::parse(talk.lines().back().payload_json).at("reason") == why);
}

TEST_CASE(
    "A recipe that cannot be written has a line that says so, and the folder's loss is told") {
  Talk talk;
  REQUIRE(talk.ask("session.open", introduction).contains("result"));
  const auto blockers = [&] {
    std::vector<std::string> kinds;
    const json ready = talk.ask("system.ready").at("result");
    for (const json& one : ready.at("blockers")) kinds.push_back(one.at("kind"));
    return kinds;
  };
  CHECK(std::ranges::count(blockers(), "recipes.unreadable") == 0);
  talk.services.recipes = talk.folder / "gone";
  CHECK(std::ranges::count(blockers(), "recipes.unreadable") == 1);
  const json recipe = json::parse(test::tiny_recipe(1));
  CHECK(talk.ask("recipe.put", {{"recipe", "new"}, {"content", recipe}}).contains("error"));
  const auto lines = talk.lines();
  REQUIRE(lines.size() == 2);
  CHECK(lines[0].kind == "recipe.put");
  CHECK(lines[1].kind == "recipe.not_put");
  CHECK_THAT(lines[1].payload_json, Catch::Contains("error"));
}

TEST_CASE("Stops are told as what changes something") {
  Talk talk;
  REQUIRE(talk.ask("session.open", introduction).contains("result"));
  std::size_t found = 0;
  const json document = talk.ask("rpc.discover").at("result");
  for (const json& method : document.at("methods"))
    if (method["name"] == "rig.halt" || method["name"] == "rig.estop")
      found += method["x-changes"] == true ? 1 : 0;
  CHECK(found == 2);
}

}  // namespace weftd_conversation_test
