// The store on a real server, which tests/scenario/lab_store.py starts: socket folder in
// WEFT_LAB_TEST_SOCKET, logins ada (submitter), eve (reader) and r1 to r8 (rigs).

#include <catch2/catch.hpp>
#include <cstdlib>
#include <map>
#include <set>
#include <thread>

#include "daemon/service/lab/lab_store.hpp"

namespace weft::daemon::test::lab_store {

using namespace lab;

using std::chrono::milliseconds;
using std::chrono::seconds;

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  REQUIRE(value != nullptr);
  return value;
}

LabAddress address_as(const std::string& login) {
  const auto address =
      LabAddress::parse("postgresql://" + login + "@/lab?host=" + variable("WEFT_LAB_TEST_SOCKET"));
  REQUIRE(address);
  return *address;
}

LabStore open_as(const std::string& login) {
  auto store = LabStore::open(address_as(login), "test");
  if (!store) FAIL(to_string(store.error()));
  return std::move(*store);
}

Connection connect_as(const std::string& login, const PostgresLimits& limits = {}) {
  auto made = Connection::open(address_as(login), "test", limits);
  if (!made) FAIL(to_string(made.error()));
  return std::move(*made);
}

/// On the server's clock, like the leases.
void sleep(double duration_s) {
  REQUIRE(connect_as("admin").run("SELECT pg_sleep($1)", duration_s));
}

std::int64_t count(const char* sql) {
  const auto rows = connect_as("admin").run(sql);
  REQUIRE(rows);
  return rows->integer(0, 0);
}

RigEntry rig_entry(const std::string& name) {
  return {.name = name,
          .address = "tls://" + name + ":8443",
          .bench = BenchKind::simulated,
          .state = "safe",
          .rig_sha256 = std::string(64, 'a')};
}

/// The eight rigs, published.
std::vector<std::string> publish_rigs() {
  std::vector<std::string> names;
  for (int i = 1; i <= 8; ++i) {
    names.push_back("r" + std::to_string(i));
    const Status done = open_as(names.back()).publish_rig(rig_entry(names.back()));
    if (!done) FAIL(to_string(done.error()));
  }
  return names;
}

RunEntry run_entry(const std::string& rig, const std::string& run, std::int64_t started_us) {
  return {.rig = rig,
          .run = run,
          .recipe = "khan2016",
          .recipe_sha256 = std::string(64, 'b'),
          .seed = 5,
          .fabrics = {"velvet", "raw \"silk\", 50%"},
          .bench = BenchKind::simulated,
          .state = "running",
          .trials_planned = 680,
          .trials_complete = 3,
          .started_us = started_us,
          .ended_us = {},
          .place = "/data/" + run,
          .revision_us = started_us};
}

std::int64_t submit(const std::vector<std::string>& fabrics, const std::vector<std::string>& rigs,
                    const std::string& key = {}) {
  const auto id = open_as("ada").submit({.name = "made up",
                                         .recipe_text = "{\"fabrics\": \"\u00e9\"}",
                                         .recipe_sha256 = std::string(64, 'c'),
                                         .seed = 7,
                                         .parameters_json = R"({"force": 5.0})",
                                         .fabrics = fabrics,
                                         .rigs = rigs,
                                         .key = key});
  if (!id) FAIL(to_string(id.error()));
  return *id;
}

/// Cancels what earlier tests left, so that claims find this test's parts only.
void clear() {
  REQUIRE(connect_as("admin").run("DELETE FROM weft.part_lease"));
  REQUIRE(connect_as("admin").run("DELETE FROM weft.part"));
  REQUIRE(connect_as("admin").run("DELETE FROM weft.campaign"));
}

const PartEntry& part(const LabCampaign& campaign, std::int64_t number) {
  return campaign.parts.at(static_cast<std::size_t>(number - 1));
}

TEST_CASE("eight clients take each of 200 parts once", "[.][lab-server]") {
  const auto rigs = publish_rigs();
  clear();
  std::vector<std::string> fabrics;
  for (int i = 1; i <= 200; ++i) fabrics.push_back("fabric " + std::to_string(i));
  const std::int64_t id = submit(fabrics, rigs);
  struct Taken {
    std::vector<std::int64_t> numbers;
    std::string error;
  };
  std::vector<LabStore> stores;
  for (const auto& rig : rigs) stores.push_back(open_as(rig));
  std::vector<Taken> taken(rigs.size());
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < rigs.size(); ++i)
      threads.emplace_back([&, i] {
        while (true) {
          const auto claimed = stores[i].claim(rigs[i], {}, seconds(60));
          if (!claimed) taken[i].error += to_string(claimed.error());
          if (!claimed || !*claimed) return;
          taken[i].numbers.push_back((*claimed)->lease.number);
          const Status done = stores[i].finish(
              (*claimed)->lease, {.run = "R-000001", .dataset_sha256 = std::string(64, 'd')});
          if (!done) taken[i].error += to_string(done.error());
        }
      });
  }
  std::multiset<std::int64_t> all;
  for (const Taken& each : taken) {
    CHECK(each.error == "");
    all.insert(each.numbers.begin(), each.numbers.end());
  }
  CHECK(all.size() == 200);
  CHECK(std::set(all.begin(), all.end()).size() == 200);
  const auto campaign = open_as("eve").campaign(id);
  REQUIRE(campaign);
  CHECK(campaign->state == "done");
  for (const PartEntry& each : campaign->parts) {
    CHECK(each.state == PartState::done);
    CHECK(each.attempt == 1);
  }
}

TEST_CASE("a part with an expired lease is taken again, and its old token is refused",
          "[.][lab-server]") {
  publish_rigs();
  clear();
  const std::int64_t id = submit({"velvet", "wool"}, {"r1", "r2"});
  LabStore first = open_as("r1"), second = open_as("r2"), reader = open_as("eve");
  const auto old = first.claim("r1", {.fabrics = {"wool"}}, seconds(1));
  REQUIRE(old);
  REQUIRE(*old);
  CHECK((*old)->fabric == "wool");
  CHECK((*old)->seed == 7);
  CHECK((*old)->recipe_text == "{\"fabrics\": \"\u00e9\"}");
  CHECK((*old)->parameters_json == R"({"force": 5.0})");
  CHECK((*old)->lease.token.size() == 64);
  CHECK_FALSE(*second.claim("r2", {.fabrics = {"wool"}}, seconds(60)));
  CHECK_FALSE(*second.claim("r2", {.refused_campaigns = {id}}, seconds(60)));
  REQUIRE(first.renew((*old)->lease, seconds(1)));
  sleep(1.1);
  CHECK(part(*reader.campaign(id), 2).lease_expired);
  const auto again = second.claim("r2", {.fabrics = {"wool"}}, seconds(60));
  REQUIRE(again);
  REQUIRE(*again);
  CHECK((*again)->lease.number == 2);
  CHECK((*again)->attempt == 2);

  const PartResult stale{.run = "R-000009", .dataset_sha256 = std::string(64, 'e')};
  const Status refused = first.finish((*old)->lease, stale);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::wrong_state);
  CHECK(first.sqlstate() == "WL001");
  CHECK_FALSE(first.renew((*old)->lease, seconds(60)));
  CHECK_FALSE(first.give_back((*old)->lease));
  // The token is of no use to another login.
  CHECK_FALSE(first.finish((*again)->lease, stale));
  CHECK(part(*reader.campaign(id), 2).state == PartState::held);
  CHECK(part(*reader.campaign(id), 2).holder == "r2");
  CHECK(part(*reader.campaign(id), 2).dataset_sha256 == "");

  const PartResult result{.run = "R-000002", .dataset_sha256 = std::string(64, 'f')};
  CHECK(second.finish((*again)->lease, result));
  CHECK(second.finish((*again)->lease, result));
  CHECK_FALSE(second.finish((*again)->lease, stale));
  CHECK(part(*reader.campaign(id), 2).run == "R-000002");
  CHECK(reader.campaign(id)->state == "running");
  const auto last = second.claim("r2", {}, seconds(60));
  REQUIRE(*last);
  CHECK(second.finish((*last)->lease, {.is_done = false, .error = "fabric torn"}));
  CHECK(reader.campaign(id)->state == "failed");
  CHECK(part(*reader.campaign(id), 1).error == "fabric torn");
}

TEST_CASE("an expired lease that no rig has taken can still be finished", "[.][lab-server]") {
  publish_rigs();
  clear();
  const std::int64_t id = submit({"velvet"}, {"r1"});
  LabStore rig = open_as("r1");
  const auto taken = rig.claim("r1", {}, seconds(1));
  REQUIRE(*taken);
  sleep(1.1);
  CHECK(rig.finish((*taken)->lease, {.run = "R-000001", .dataset_sha256 = std::string(64, 'f')}));
  CHECK(rig.campaign(id)->state == "done");
  CHECK_FALSE(rig.claim("r1", {}, seconds(0)));
  CHECK(rig.sqlstate() == "22023");
}

TEST_CASE("a rig that claims its part again has a new token only", "[.][lab-server]") {
  publish_rigs();
  clear();
  const std::int64_t id = submit({"velvet"}, {"r1"});
  LabStore rig = open_as("r1");
  const auto before = rig.claim("r1", {}, seconds(1));
  REQUIRE(*before);
  sleep(1.1);
  const auto after = rig.claim("r1", {}, seconds(60));
  REQUIRE(*after);
  CHECK((*after)->lease.number == (*before)->lease.number);
  CHECK((*after)->lease.token != (*before)->lease.token);
  CHECK_FALSE(rig.renew((*before)->lease, seconds(60)));
  CHECK_FALSE(rig.give_back((*before)->lease));
  CHECK_FALSE(rig.finish((*before)->lease, {.run = "R-000001"}));
  CHECK(rig.sqlstate() == "WL001");
  CHECK(part(*rig.campaign(id), 1).state == PartState::held);
  CHECK(rig.finish((*after)->lease, {.run = "R-000002"}));
}

TEST_CASE("two parts that are finished at the same moment end their campaign", "[.][lab-server]") {
  publish_rigs();
  clear();
  const std::int64_t id = submit({"velvet", "wool"}, {"r1", "r2"});
  LabStore first = open_as("r1"), second = open_as("r2");
  const auto one = first.claim("r1", {}, seconds(60)), two = second.claim("r2", {}, seconds(60));
  REQUIRE(*one);
  REQUIRE(*two);
  Connection slow = connect_as("r1");
  REQUIRE(slow.run("BEGIN"));
  const PartLease& lease = (*one)->lease;
  REQUIRE(slow.run("SELECT weft.finish_part($1, $2, $3, true, 'R-000001', '', '')", lease.campaign,
                   lease.number, lease.token));
  bool is_finished = false;
  {
    const std::jthread other(
        [&] { is_finished = second.finish((*two)->lease, {.run = "R-000001"}).has_value(); });
    sleep(0.3);  // the second waits for the first
    REQUIRE(slow.run("COMMIT"));
  }
  CHECK(is_finished);
  CHECK(first.campaign(id)->state == "done");
}

TEST_CASE("a cancelled campaign gives out no part; a held one may be finished", "[.][lab-server]") {
  publish_rigs();
  clear();
  const std::int64_t id = submit({"velvet", "wool", "silk"}, {"r1", "r2"});
  LabStore one = open_as("r1"), two = open_as("r2"), ada = open_as("ada");
  const auto held = one.claim("r1", {}, seconds(60)), returned = two.claim("r2", {}, seconds(60));
  REQUIRE(*held);
  REQUIRE(*returned);
  CHECK_FALSE(one.renew((*held)->lease, seconds(60))->is_cancelled);
  REQUIRE(ada.cancel(id));
  CHECK(ada.cancel(id));
  CHECK(one.renew((*held)->lease, seconds(60))->is_cancelled);
  CHECK(two.give_back((*returned)->lease));
  CHECK_FALSE(*two.claim("r2", {}, seconds(60)));
  CHECK(one.finish((*held)->lease, {.run = "R-000001"}));
  const auto campaign = ada.campaign(id);
  CHECK(campaign->state == "cancelled");
  CHECK(part(*campaign, 1).state == PartState::done);
  CHECK(part(*campaign, 2).state == PartState::cancelled);
  CHECK(part(*campaign, 3).state == PartState::cancelled);
  CHECK(ada.cancel(999'999).error().code == Errc::not_found);
}

TEST_CASE("a repeated submission or publication changes nothing", "[.][lab-server]") {
  publish_rigs();
  clear();
  CHECK(submit({"velvet"}, {"r1"}, "key 1") == submit({"velvet"}, {"r1"}, "key 1"));
  CHECK(submit({"velvet"}, {"r1"}) != submit({"velvet"}, {"r1"}));
  CHECK(open_as("ada")
            .submit({.name = "x",
                     .recipe_text = "{}",
                     .recipe_sha256 = std::string(64, 'c'),
                     .seed = {},
                     .fabrics = {"velvet"},
                     .rigs = {"r1", "unknown"}})
            .error()
            .code == Errc::not_found);

  LabStore rig = open_as("r1");
  const RunEntry before = run_entry("r1", "R-000100", 1'790'000'000'123'456);
  RunEntry after = before;
  after.state = "complete";
  after.trials_complete = 680;
  after.ended_us = before.started_us + 1;
  after.revision_us = before.revision_us + 1;
  std::vector<TrialEntry> trials;
  for (int i = 0; i < 12'000; ++i)
    trials.push_back({i, "velvet", "M1", i + 1, "complete", std::string(64, '9')});
  const auto publish = [&] {
    REQUIRE(rig.publish_run(before));
    REQUIRE(rig.publish_run(after));
    REQUIRE(rig.publish_dataset({"r1", "R-000100", std::string(64, '8'), 680, 12345, "/d.h5"}));
    REQUIRE(rig.publish_certificate({"r1", "R-000100", std::string(64, '7'), R"({"a":  1})"}));
    REQUIRE(rig.publish_trials("r1", "R-000100", trials));
  };
  const char* const state =
      "SELECT hashtextextended((SELECT string_agg(t::text || t.xmin::text, ',' ORDER BY index) "
      "FROM "
      "weft.trial t) || (SELECT r::text || r.xmin::text FROM weft.run r WHERE run = 'R-000100') || "
      "(SELECT string_agg(d::text || d.xmin::text, ',') FROM weft.dataset d) || (SELECT "
      "string_agg(c::text || c.xmin::text, ',') FROM weft.certificate c), 0)";
  publish();
  const std::int64_t first = count(state);
  publish();
  CHECK(count(state) == first);
  CHECK(count("SELECT count(*) FROM weft.trial") == 12'000);
  CHECK(count("SELECT length(document::text) FROM weft.certificate") == 9);

  const auto found = open_as("eve").runs({.rig = "r1"}, {}, 10);
  REQUIRE(found);
  REQUIRE(found->runs.size() == 1);
  CHECK(found->runs[0].state == "complete");
  CHECK(found->runs[0].started_us == before.started_us);
  CHECK(found->runs[0].ended_us == after.ended_us);
  CHECK(found->runs[0].fabrics == before.fabrics);
  CHECK(found->runs[0].seed == 5);
  CHECK(rig.publish_dataset({"r1", "R-000999", std::string(64, '8'), 1, 1, ""}).error().code ==
        Errc::not_found);
  CHECK(rig.publish_dataset({"r1", "R-000100", "no digest", 1, 1, ""}).error().code ==
        Errc::wrong_state);
  CHECK(rig.publish_rig({.name = std::string("a\0b", 3)}).error().code == Errc::invalid_argument);
  CHECK(rig.is_connected());
}

TEST_CASE("pages and searches find each run once", "[.][lab-server]") {
  publish_rigs();
  LabStore rig = open_as("r2"), reader = open_as("eve");
  constexpr std::int64_t start = 1'780'000'000'000'000;
  for (int i = 0; i < 25; ++i) {  // several start at the same moment
    RunEntry run = run_entry("r2", "R-0002" + std::to_string(10 + i), start + i / 10);
    if (i == 3) run.recipe = "vibro_Slide%", run.bench = BenchKind::real;
    REQUIRE(rig.publish_run(run));
  }
  REQUIRE(rig.publish_trials(
      "r2", "R-000213", {{0, "velvet", "M1", 1, "complete", "abcdef" + std::string(58, '0')}}));
  std::set<std::string> seen;
  std::optional<std::int64_t> after;
  int pages = 0;
  do {
    const auto page = reader.runs({.rig = "r2"}, after, 10);
    REQUIRE(page);
    for (const RunEntry& run : page->runs) CHECK(seen.insert(run.run).second);
    after = page->next;
    ++pages;
  } while (after);
  CHECK(seen.size() == 25);
  CHECK(pages == 3);
  CHECK_FALSE(reader.runs({}, {}, 0));
  CHECK_FALSE(reader.runs({}, {}, 1001));

  // A full result comes from the newest runs, a partial one from all: both in the same order.
  const auto page = reader.runs({.rig = "r2"}, {}, 100);
  for (const std::size_t limit : {std::size_t{10}, std::size_t{100}}) {
    const auto found = reader.search({{.rig = "r2"}, "r-0002", "velvet", ""}, limit);
    REQUIRE(found);
    REQUIRE(found->size() == std::min(limit, std::size_t{25}));
    for (std::size_t i = 0; i < found->size(); ++i) CHECK((*found)[i].key == page->runs[i].key);
  }

  const auto search = [&](LabSearch wanted) {
    const auto runs = reader.search(wanted, 100);
    REQUIRE(runs);
    return runs->size();
  };
  CHECK(search({{.rig = "r2"}, "", "", ""}) == 25);
  CHECK(search({{.rig = "r2"}, "VIBRO_slide% r-0002", "", ""}) == 1);
  CHECK(search({{.rig = "r2"}, "slide_", "", ""}) == 0);
  CHECK(search({{.rig = "r2"}, "' OR true --", "", ""}) == 0);
  CHECK(search({{.rig = "r2"}, "", "velvet", ""}) == 25);
  CHECK(search({{.rig = "r2"}, "", "velv", ""}) == 0);
  CHECK(search({{.rig = "r2"}, "", "raw \"silk\", 50%", ""}) == 25);
  CHECK(search({{.rig = "r2", .bench = BenchKind::real}, "", "", ""}) == 1);
  CHECK(search({{.rig = "r2", .since_us = start + 1, .until_us = start + 2}, "", "", ""}) == 10);
  CHECK(search({{}, "", "", "ABCDEF"}) == 1);
  CHECK(search({{.rig = "r2"}, "", "", std::string(64, 'b')}) == 25);
  CHECK_FALSE(reader.search({{}, "", "", "abc"}, 10));
  CHECK_FALSE(reader.search({{}, "", "", "abcx"}, 10));
}

TEST_CASE("a rig publishes and claims for itself only", "[.][lab-server]") {
  publish_rigs();
  LabStore rig = open_as("r1");
  for (const Status& refused :
       {rig.publish_rig(rig_entry("r2")), rig.publish_rig(rig_entry("squatted")),
        rig.publish_run(run_entry("r2", "R-000777", 1)),
        rig.publish_trials("r2", "R-000210", {{0, "x", "M1", 1, "complete", ""}})}) {
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == Errc::wrong_state);
    CHECK(refused.error().got == "SQLSTATE 42501");
  }
  CHECK_FALSE(rig.claim("r2", {}, seconds(60)));
  CHECK(rig.sqlstate() == "42501");
}

TEST_CASE("channels report new parts and changed rigs", "[.][lab-server]") {
  publish_rigs();
  LabStore rig = open_as("r1"), page = open_as("eve");
  REQUIRE(rig.listen("weft_parts"));
  REQUIRE(page.listen("weft_rigs"));
  CHECK_FALSE(rig.listen("weft; DROP"));
  CHECK_FALSE(*rig.wait(milliseconds(20)));
  const std::int64_t id = submit({"velvet"}, {"r1"});
  const auto news = rig.wait(seconds(10));
  REQUIRE(news);
  REQUIRE(*news);
  CHECK((*news)->channel == "weft_parts");
  CHECK((*news)->payload == std::to_string(id));
  RigEntry entry = rig_entry("r1");
  REQUIRE(rig.publish_rig(entry));
  CHECK_FALSE(*page.wait(milliseconds(20)));  // nothing changed
  entry.state = "latched";
  REQUIRE(rig.publish_rig(entry));
  const auto changed = page.wait(seconds(10));
  REQUIRE(changed);
  REQUIRE(*changed);
  CHECK((*changed)->payload == "r1");
  clear();
}

TEST_CASE("a statement without end fails at the limit of the server, then of the client",
          "[.][lab-server]") {
  Connection connection =
      connect_as("eve", {.statement = seconds(1), .lock = seconds(1), .answer = seconds(1)});
  const auto late = connection.run("SELECT pg_sleep(30)");
  REQUIRE_FALSE(late);
  CHECK(late.error().code == Errc::timeout);
  CHECK(connection.is_open());
  REQUIRE(connection.run("SET statement_timeout = 0"));
  const auto silent = connection.run("SELECT pg_sleep(30)");
  REQUIRE_FALSE(silent);
  CHECK(silent.error().code == Errc::timeout);
  CHECK_FALSE(connection.is_open());
  CHECK(connection.run("SELECT 1").error().code == Errc::io);
}

TEST_CASE("a failed transaction changes nothing", "[.][lab-server]") {
  Connection connection = connect_as("admin");
  const Status failed = connection.transact([&]() -> Status {
    REQUIRE(connection.run("CREATE TABLE public.half_done (a int)"));
    const auto refused = connection.run("SELECT 1 / $1::int", 0);
    REQUIRE_FALSE(refused);
    return pass(refused.error());
  });
  REQUIRE_FALSE(failed);
  CHECK(connection.sqlstate() == "22012");
  CHECK(count("SELECT count(*) FROM pg_class WHERE relname = 'half_done'") == 0);
}

// Last: it restarts the server.
TEST_CASE("after a restart of the server a call fails, and the store connects again",
          "[.][lab-server]") {
  publish_rigs();
  LabStore store = open_as("r1");
  REQUIRE(store.listen("weft_parts"));
  REQUIRE(std::system(variable("WEFT_LAB_TEST_STOP").c_str()) == 0);
  const auto lost = store.rigs();
  REQUIRE_FALSE(lost);
  CHECK(lost.error().code == Errc::io);
  CHECK_FALSE(store.is_connected());
  CHECK(store.rigs().error().code == Errc::io);
  CHECK(store.retry_wait() == milliseconds(0));
  CHECK_FALSE(store.reconnect());
  CHECK(store.retry_wait() == milliseconds(500));
  CHECK_FALSE(store.reconnect());
  CHECK(store.retry_wait() == milliseconds(1000));
  CHECK_FALSE(store.wait(milliseconds(1)));
  REQUIRE(std::system(variable("WEFT_LAB_TEST_START").c_str()) == 0);
  const Status back = store.reconnect();
  if (!back) FAIL(to_string(back.error()));
  CHECK(store.retry_wait() == milliseconds(0));
  CHECK(store.rigs()->size() == 8);
  const std::int64_t id = submit({"velvet"}, {"r1"});
  const auto news = store.wait(seconds(10));
  REQUIRE(news);
  REQUIRE(*news);
  CHECK((*news)->payload == std::to_string(id));
}

}  // namespace weft::daemon::test::lab_store
