// Runs in memory; the others are read from the store, page by page. SIMULATED.

#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace run_memory_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::TemporaryFolder;

namespace {

constexpr std::int64_t run_count = 200, interrupted = 3, unfinished = 4;

/// Ended runs; all are complete except two of the oldest.
void store_runs(const TemporaryFolder& folder) {
  RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
  RunChange change;
  for (std::int64_t number = 1; number <= run_count; ++number) {
    StoredRun run;
    run.number = number;
    run.state = number == interrupted ? RunState::interrupted : RunState::ended;
    run.outcome = number == unfinished ? "aborted" : "complete";
    if (number == interrupted) run.outcome = "interrupted";
    run.trials_done = 1;
    run.trials_planned = number == unfinished ? 2 : 1;
    change.runs.push_back(run);
  }
  REQUIRE(store.commit(change));
}

std::vector<std::int64_t> numbers(const std::vector<RunView>& runs) {
  std::vector<std::int64_t> out;
  for (const RunView& run : runs) out.push_back(run.stored.number);
  return out;
}

}  // namespace

TEST_CASE("of the runs that are over the newest are in memory, and those that can be resumed") {
  const TemporaryFolder folder;
  store_runs(folder);
  const test::RunManagerBench bench(folder);
  const auto loaded = numbers(bench.manager->loaded());
  REQUIRE(loaded.size() == most_ended_loaded + 2);
  CHECK(loaded[0] == interrupted);
  CHECK(loaded[1] == unfinished);
  CHECK(loaded[2] == run_count - static_cast<std::int64_t>(most_ended_loaded) + 1);
  CHECK(loaded.back() == run_count);
}

TEST_CASE("a run that is not in memory is found, refuses orders as any other, and stays out") {
  const TemporaryFolder folder;
  store_runs(folder);
  test::RunManagerBench bench(folder);
  RunManager& manager = *bench.manager;
  const std::size_t loaded = manager.loaded().size();
  CHECK(manager.get("R-000010")->stored.outcome == "complete");
  CHECK(manager.loaded().size() == loaded);
  const auto refused = manager.order("R-000010", Order::stop, "test");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::wrong_state);
  bool is_called = false;
  manager.when_ended("R-000011", [&](const RunView&) { is_called = true; }, {});
  CHECK(is_called);
  manager.tick();
  CHECK(manager.loaded().size() == loaded);
  CHECK(manager.get("R-000201").error().code == Errc::not_found);
  CHECK(manager.get("R-10").error().code == Errc::not_found);
}

TEST_CASE("runs are listed page by page in either order, by state") {
  const TemporaryFolder folder;
  store_runs(folder);
  const test::RunManagerBench bench(folder);
  const RunManager& manager = *bench.manager;
  const auto first = manager.page({}, {}, 90);
  REQUIRE(first);
  CHECK(first->runs.front().stored.number == 1);
  CHECK(first->next == 91);
  const auto last = manager.page({}, 181, 90);
  CHECK(last->runs.size() == 20);
  CHECK_FALSE(last->next);
  const auto newest = manager.page({.newest_first = true}, {}, 3);
  CHECK(numbers(newest->runs) == std::vector<std::int64_t>{200, 199, 198});
  CHECK(newest->next == 197);
  const auto of_state = manager.page({.states = {RunState::interrupted}}, {}, 3);
  CHECK(numbers(of_state->runs) == std::vector<std::int64_t>{interrupted});
  CHECK(manager.page({.states = {RunState::queued, RunState::running}}, {}, 3)->runs.empty());
}

TEST_CASE("memory does not grow with the runs that have ended, and each is as it was") {
  struct Observer final : RunObserver {
    std::vector<std::int64_t> unloaded;
    void on_run_changed(const RunView& /*run*/) override {}
    void on_run_unloaded(std::int64_t run) override { unloaded.push_back(run); }
    void on_vote(const RunView& /*run*/) override {}
    void on_queue_changed(const RunQueue& /*queue*/, std::string_view /*by*/) override {}
    void on_rig_state_changed(const RigState& /*rig*/, std::string_view /*by*/) override {}
  } observer;
  const TemporaryFolder folder;
  const CampaignRequest request = test::request_in(folder, test::tiny_recipe(1));
  test::Posted posted;
  RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
  RunManager manager({.rig = request.rig,
                      .data = folder.path(),
                      .post = [&](std::function<void()> work) { posted.post(std::move(work)); },
                      .now = [] { return std::chrono::nanoseconds(0); },
                      .utc_us = [] { return std::int64_t{0}; },
                      .observer = &observer,
                      .perform =
                          [](const CampaignRequest&, const CampaignHooks&) {
                            CampaignSummary summary;
                            summary.trials_planned = summary.trials_complete = 2;
                            return Result<CampaignSummary>(summary);
                          }},
                     store);
  constexpr std::size_t many = most_ended_loaded + 10;
  for (std::size_t i = 0; i < many; ++i) {
    const auto run = test::submit(manager, {request.recipe, {}, {}, "test"}, request.rig);
    REQUIRE(run);
    REQUIRE(posted.run_until([&] { return !manager.active(); }));
    manager.tick();
  }
  CHECK(manager.loaded().size() == most_ended_loaded);
  CHECK(observer.unloaded.size() == many - most_ended_loaded);
  CHECK(observer.unloaded.front() == 1);
  const auto oldest = manager.get("R-000001");
  REQUIRE(oldest);
  CHECK(oldest->state() == RunState::ended);
  CHECK(oldest->stored.outcome == "complete");
  CHECK(oldest->trials_planned == 2);
}

}  // namespace run_memory_test
