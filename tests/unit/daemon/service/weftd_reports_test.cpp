// Answers of the daemon's own methods to one client: lists and journals in pages, users of actions,
// leases.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/unit/daemon/service/weftd_talk.hpp"

namespace weftd_reports_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::server;
using nlohmann::json;
using test::introduction;
using test::Talk;
using test::TemporaryFolder;

TEST_CASE("An answer too long for a line is refused, with a hint how to request less") {
  Talk talk;
  talk.methods.add({"much.say", "", {}, {}, {}, ""}, [](const rpc::Call&) -> rpc::Outcome {
    return "\"" + std::string(Session::most_answer_bytes, 'x') + "\"";
  });
  REQUIRE(talk.query("session.open", introduction()).contains("result"));
  const json answer = talk.query("much.say");
  CHECK(talk.kind_of(answer) == "answer.too_long");
  CHECK_THAT(answer["error"]["data"]["hint"].get<std::string>(), Catch::Contains("most"));
}

TEST_CASE("The journal comes in pages that a line can hold, whole") {
  Talk talk;
  REQUIRE(talk.query("session.open", introduction()).contains("result"));
  constexpr std::size_t count = 3000;
  const std::string payload = json{{"text", std::string(900, 'x')}}.dump();
  const runs::JournalLine note{0, 0, "", "note", "test", payload};
  REQUIRE(talk.bench.store.commit({.journal = std::vector(count, note)}));
  const json tail = talk.query("log.tail", {{"most", 10'000}}).at("result");
  CHECK(tail.dump().size() < std::size_t{1100} << 10);
  CHECK(tail["lines"].size() + tail["left_off"].get<std::size_t>() == count);
  CHECK(tail["lines"].back()["sequence"] == count);
  CHECK(tail["lines"].front()["sequence"] == count - tail["lines"].size() + 1);
  std::size_t found = 0, pages = 0;
  for (json from = 1; !from.is_null(); ++pages) {
    const json page = talk.query("log.query", {{"most", 10'000}, {"from", from}}).at("result");
    for (const json& line : page["lines"]) REQUIRE(line["sequence"] == ++found);
    from = page["next"];
  }
  CHECK(found == count);
  CHECK(pages == 3);
}

TEST_CASE("Runs are listed in pages, the oldest first") {
  Talk talk;
  REQUIRE(talk.query("session.open", introduction()).contains("result"));
  talk.bench.manager->halt(runs::RigState::Stop::halt, "test");  // no run starts
  for (int i = 0; i < 5; ++i) talk.bench.submit();
  const auto page = [&](const json& params) { return talk.query("run.list", params).at("result"); };
  const json first = page({{"most", 3}});
  CHECK(first["runs"].size() == 3);
  CHECK(first["next"] == "R-000004");
  const json last = page({{"most", 3}, {"from", first["next"]}});
  REQUIRE(last["runs"].size() == 2);
  CHECK(last["runs"][0]["run"] == "R-000004");
  CHECK(last["next"].is_null());
  CHECK(page({{"state", "ended"}})["runs"].empty());
  CHECK(talk.kind_of(talk.query("run.list", {{"most", 0}})) == "param.range");
  CHECK(talk.kind_of(talk.query("run.list", {{"from", "R-9"}})) == "not_found");
  CHECK(talk.query("data.list").at("result").at("next").is_null());
}

TEST_CASE("A run is reported with who changed it and who queued it") {
  Talk talk;
  REQUIRE(talk.query("session.open", introduction()).contains("result"));
  talk.bench.manager->halt(runs::RigState::Stop::halt, "test");
  const std::string run = talk.bench.submit().stored.id();
  CHECK(talk.query("run.get", {{"run", run}}).at("result").at("by") == "test");
  const json gone = talk.query("run.withdraw", {{"run", run}}).at("result");
  CHECK(gone["by"] == "s-1 (ada)");
  CHECK(gone["submitted_by"] == "test");
}

TEST_CASE("The topic of a lease is its state: who holds it, and the last that was done with it") {
  Talk talk;
  REQUIRE(talk.query("session.open", introduction()).contains("result"));
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
  const std::string first = talk.query("lease.acquire").at("result").at("lease");
  CHECK(has_only("acquired"));
  CHECK(snapshot()["held"]["lease"] == first);
  talk.now += std::chrono::seconds(2);
  talk.query("lease.renew", {{"lease", first}});
  CHECK(has_only("renewed"));
  talk.query("lease.renew", {{"lease", first}});
  talk.query("lease.release", {{"lease", first}});
  CHECK(has_only("released"));
  CHECK_FALSE(snapshot().contains("held"));
  CHECK(snapshot()["by"] == "s-1 (ada)");
  talk.query("lease.acquire");
  CHECK(has_only("acquired"));
  talk.now += std::chrono::hours(1);
  for (const access::Lease& lease : talk.leases.expire(talk.now))
    api::notify_lease_expired(talk.services, lease);
  CHECK(has_only("expired"));
  CHECK(snapshot()["by"] == "auto:time");
  std::vector<std::string> kinds;
  for (const auto& line : talk.lines()) kinds.push_back(line.kind);
  CHECK(kinds == std::vector<std::string>{"lease.acquired", "lease.renewed", "lease.released",
                                          "lease.acquired", "lease.expired"});
}

TEST_CASE("The reason of a broken lease is in the answer, the event and the journal") {
  Talk talk;
  REQUIRE(talk.query("session.open", introduction()).contains("result"));
  const std::string lease = talk.query("lease.acquire").at("result").at("lease");
  const std::string why = "its owner has gone home";
  CHECK(talk.query("lease.break", {{"lease", lease}, {"reason", why}}).at("result").at("reason") ==
        why);
  const json reported = json::parse(talk.hub.open({{"lease:*"}, Mode::latest}).snapshot_json);
  CHECK(reported.at("lease:rig:bench").at("broken").at("reason") == why);
  CHECK(talk.lines().back().kind == "lease.broken");
  CHECK(json::parse(talk.lines().back().payload_json).at("reason") == why);
}

TEST_CASE("A recipe that cannot be written has a journal line, and a lost folder is reported") {
  Talk talk;
  REQUIRE(talk.query("session.open", introduction()).contains("result"));
  const auto blockers = [&] {
    std::vector<std::string> kinds;
    const json ready = talk.query("system.ready").at("result");
    for (const json& one : ready.at("blockers")) kinds.push_back(one.at("kind"));
    return kinds;
  };
  CHECK(std::ranges::count(blockers(), "recipes.unreadable") == 0);
  talk.services.recipes = talk.folder / "gone";
  CHECK(std::ranges::count(blockers(), "recipes.unreadable") == 1);
  const json recipe = json::parse(test::tiny_recipe(1));
  CHECK(talk.query("recipe.put", {{"recipe", "new"}, {"content", recipe}}).contains("error"));
  const auto lines = talk.lines();
  REQUIRE(lines.size() == 2);
  CHECK(lines[0].kind == "recipe.put");
  CHECK(lines[1].kind == "recipe.not_put");
  CHECK_THAT(lines[1].payload_json, Catch::Contains("error"));
}

TEST_CASE("A daemon that is shutting down reports it, and its refusals are retryable") {
  Talk talk;
  REQUIRE(talk.query("session.open", introduction()).contains("result"));
  talk.bench.manager->halt(runs::RigState::Stop::halt, "test");
  talk.bench.manager->close();
  const json ready = talk.query("system.ready").at("result");
  CHECK(ready["blockers"][0]["kind"] == "daemon.stops");
  const json refused = talk.query("rig.reset", {{"reason", "looked at it"}});
  CHECK(talk.kind_of(refused) == "state.conflict");
  CHECK(refused["error"]["data"]["retryable"] == true);
  CHECK(refused["error"]["data"]["where"] == "daemon");
}

TEST_CASE("Stops are described as changes") {
  Talk talk;
  REQUIRE(talk.query("session.open", introduction()).contains("result"));
  std::size_t found = 0;
  const json document = talk.query("rpc.discover").at("result");
  for (const json& method : document.at("methods"))
    if (method["name"] == "rig.halt" || method["name"] == "rig.estop")
      found += method["x-changes"] == true ? 1 : 0;
  CHECK(found == 2);
}

}  // namespace weftd_reports_test
