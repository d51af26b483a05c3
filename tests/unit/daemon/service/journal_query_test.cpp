// Queries of the daemon's journal by run, kind and time, page by page.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/service/methods/services.hpp"
#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace journal_query_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using runs::RunChange;
using runs::RunStore;
using test::TemporaryFolder;

namespace {

/// Lines 1 to `lines`, a second apart; the runs alternate, every tenth line is a halt.
RunStore journal_of(const TemporaryFolder& folder, int lines) {
  RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
  RunChange change;
  for (int i = 1; i <= lines; ++i)
    change.journal.push_back({0, i * 1'000'000LL, i % 2 == 0 ? "R-000002" : "R-000001",
                              i % 10 == 0 ? "halt" : "state", "ada",
                              R"({"i":)" + std::to_string(i) + "}"});
  REQUIRE(store.commit(change));
  return store;
}

std::vector<std::int64_t> sequences(const RunStore::Page& page) {
  std::vector<std::int64_t> out;
  for (const auto& line : page.lines) out.push_back(line.sequence);
  return out;
}

}  // namespace

TEST_CASE("The journal is asked by run, kind and time") {
  const TemporaryFolder folder;
  RunStore store = journal_of(folder, 40);
  using Numbers = std::vector<std::int64_t>;
  RunStore::Query halts;
  halts.kind = "halt";
  CHECK(sequences(store.query(halts).value()) == Numbers{10, 20, 30, 40});
  halts.run = "R-000001";
  CHECK(store.query(halts).value().lines.empty());
  RunStore::Query while_it_was;
  while_it_was.since_us = 5'000'000;
  while_it_was.until_us = 8'000'000;
  CHECK(sequences(store.query(while_it_was).value()) == Numbers{5, 6, 7});
  RunStore::Query second;
  second.run = "R-000002";
  CHECK(store.query(second).value().lines.size() == 20);
  second.from = 11;
  second.most = 3;
  const auto page = store.query(second).value();
  CHECK(sequences(page) == Numbers{12, 14, 16});
  CHECK(page.next == 17);
  RunStore::Query all;
  all.most = 40;
  CHECK_FALSE(store.query(all).value().next);
  all.from = 41;
  CHECK_FALSE(store.query(all).value().next);
  CHECK(store.query(all).value().lines.empty());
}

TEST_CASE("A question that few lines answer is answered in parts, and in the end whole") {
  const TemporaryFolder folder;
  RunStore store = journal_of(folder, 50'000);
  RunStore::Query wanted;
  wanted.kind = "halt";
  wanted.since_us = 49'985'000'000;
  std::vector<std::int64_t> found;
  int pages = 0;
  for (std::optional<std::int64_t> from = 0; from; ++pages) {
    wanted.from = *from;
    const auto page = store.query(wanted).value();
    for (const std::int64_t sequence : sequences(page)) found.push_back(sequence);
    if (pages == 0) CHECK(page.lines.empty());
    from = page.next;
  }
  CHECK(found == std::vector<std::int64_t>{49'990, 50'000});
  CHECK(pages == 3);
}

TEST_CASE("log.query returns lines and the next position, and accepts whole numbers only") {
  const TemporaryFolder folder;
  RunStore store = journal_of(folder, 25);
  api::Services services;
  services.now = [] { return std::chrono::nanoseconds(); };
  services.log = &store;
  rpc::Methods methods;
  api::add_system_methods(methods, services);
  const auto requested = [&](const json& params) {
    std::optional<rpc::Outcome> reply;
    const rpc::Caller caller;
    methods.find("log.query").value()->handler({params, caller}, [&](auto out) { reply = out; });
    return reply.value();
  };
  const json reported = json::parse(requested({{"kind", "halt"}, {"most", 1}}).value());
  CHECK(reported["next"] == 11);
  REQUIRE(reported["lines"].size() == 1);
  CHECK(reported["lines"][0] == json{{"sequence", 10},
                                     {"t_us", 10'000'000},
                                     {"run", "R-000002"},
                                     {"kind", "halt"},
                                     {"by", "ada"},
                                     {"data", {{"i", 10}}}});
  CHECK(json::parse(requested({{"from", 11}, {"kind", "halt"}}).value())["next"].is_null());
  for (const char* name : {"since_us", "until_us", "from", "most"})
    for (const json& wrong : {json(-1), json(std::uint64_t{1} << 63)}) {
      const auto refused = requested({{name, wrong}});
      REQUIRE_FALSE(refused);
      CHECK(refused.error().error.where == std::string("/params/") + name);
    }
  CHECK_FALSE(requested({{"most", 0}}));
  CHECK_FALSE(requested({{"most", 10'001}}));
}

}  // namespace journal_query_test
