// The handovers of weftd's runs across restarts of the daemon: the number of starts, and who
// ordered them. There are no campaigns: handover_test covers the work itself.

#include "daemon/service/handover/handover_service.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace handover_service_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using namespace weft::daemon::handover;
using test::TemporaryFolder;

namespace {

/// One lifetime of a daemon with one complete run.
struct Life {
  test::Posted posted;
  RunStore store;
  StoredRun run;
  std::vector<HandoverState> reported;
  std::unique_ptr<HandoverService> service;

  explicit Life(const TemporaryFolder& folder)
      : store(std::move(RunStore::open(folder / "weftd.sqlite").value())) {
    if (const auto known = store.runs().value(); known.empty()) {
      run.folder = folder / "R-000001";
      run.state = RunState::ended;
      REQUIRE(test::add(store, run));
      run.outcome = "complete";
      REQUIRE(store.commit({.runs = {run}}));
    } else {
      run = known.front();
    }
    service = std::make_unique<HandoverService>(
        HandoverContext{
            .post = [this](std::function<void()> work) { posted.post(std::move(work)); },
            .utc_us = [] { return std::int64_t{0}; },
            .on_changed = [this](std::string_view,
                                 const HandoverStatus& fact) { reported.push_back(fact.state); }},
        store);
  }
  [[nodiscard]] HandoverStatus on_record() {
    return HandoverStore(store.database()).find(run.number).value().value();
  }
};

/// The daemon dies: it sends nothing any longer, and the records made while it ran stay.
void kill(std::unique_ptr<Life>& life, const TemporaryFolder& folder) {
  const HandoverStatus then = life->on_record();
  const std::int64_t number = life->run.number;
  life.reset();
  RunStore store = RunStore::open(folder / "weftd.sqlite").value();
  REQUIRE(HandoverStore(store.database()).persist(number, then));
}

}  // namespace

TEST_CASE("A handover that the daemon interrupted twice waits for a person") {
  const TemporaryFolder folder;
  auto life = std::make_unique<Life>(folder);
  life->posted.hold();  // it does not report its end
  life->service->consider(life->run, true);
  CHECK(life->on_record().state == HandoverState::running);
  CHECK(life->on_record().attempts == 1);
  life->posted.let_go();
  kill(life, folder);

  life = std::make_unique<Life>(folder);
  life->service->consider(life->run, {});
  CHECK(life->on_record().state == HandoverState::running);
  CHECK(life->on_record().attempts == 2);
  kill(life, folder);

  life = std::make_unique<Life>(folder);
  life->service->consider(life->run, {});
  const auto given_up = life->service->get(life->run.id());
  REQUIRE(given_up);
  CHECK(given_up->state == HandoverState::failed);
  CHECK(given_up->error.find("handover.start") != std::string::npos);
  CHECK(life->reported == std::vector{HandoverState::failed});
  life.reset();

  life = std::make_unique<Life>(folder);  // it stays so
  life->service->consider(life->run, {});
  CHECK(life->service->get(life->run.id())->state == HandoverState::failed);
  REQUIRE(life->service->again(life->run.id(), "ada"));
  CHECK(life->on_record().state == HandoverState::running);
  CHECK(life->on_record().attempts == 1);
  const auto is_done = [&] { return is_over(life->service->get(life->run.id())->state); };
  CHECK(life->posted.run_until(is_done));
  CHECK(life->on_record().attempts == 0);
}

TEST_CASE("A regular stop of the daemon does not count as an interrupted handover") {
  const TemporaryFolder folder;
  for (int i = 0; i < 4; ++i) {
    Life life(folder);
    life.service->consider(life.run, i == 0 ? std::optional(true) : std::nullopt);
    CHECK(life.on_record().state == HandoverState::running);
    CHECK(life.on_record().attempts == 1);
    life.service.reset();
    CHECK(life.on_record().state == HandoverState::waiting);
    CHECK(life.on_record().attempts == 0);
  }
}

TEST_CASE(
    "All trials are handed over, however the bench came to its end after them; no fewer are") {
  const TemporaryFolder folder;
  Life life(folder);
  life.run.outcome = GENERATE("aborted", "failed");
  life.run.trials_planned = 4;
  life.run.trials_done = 3;
  life.run.dataset_sha256 = "36426411";
  life.service->consider(life.run, true);
  CHECK_FALSE(life.service->get(life.run.id()));
  life.run.trials_done = 4;
  StoredRun discarded = life.run, not_concluded = life.run;
  discarded.recovered = "discard";
  not_concluded.dataset_error = "no room";
  for (const StoredRun& other : {discarded, not_concluded}) life.service->consider(other, true);
  CHECK_FALSE(life.service->get(life.run.id()));
  life.service->consider(life.run, true);
  REQUIRE(life.service->get(life.run.id()));
  CHECK(life.service->get(life.run.id())->state == HandoverState::running);
}

TEST_CASE("The recipe of a run is not searched for in its folder") {
  const TemporaryFolder folder;
  Life life(folder);
  life.service->consider(life.run, false);
  CHECK_FALSE(life.service->get(life.run.id()));
  CHECK(life.on_record().state == HandoverState::none);
}

}  // namespace handover_service_test
