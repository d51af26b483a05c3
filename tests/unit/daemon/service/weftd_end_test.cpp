// Work in progress when the daemon gets the order to end. SIMULATED.

#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace weftd_end_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::leave_interrupted;
using test::RunManagerBench;
using test::TemporaryFolder;

namespace {

/// Result of a recovery ordered just before the daemon got the order to end.
Result<RunView> settled_at_the_end(RunManagerBench& bench, Recovery choice) {
  std::optional<Result<RunView>> reported;
  const std::string id = bench.manager->loaded().front().stored.id();
  bench.manager->settle(id, choice, "test", [&](const Result<RunView>& run) { reported = run; });
  bench.manager->close();
  CHECK_FALSE(bench.manager->status().is_at_rest);
  REQUIRE(bench.posted.run_until([&] { return reported.has_value(); }));
  CHECK(bench.manager->status().is_at_rest);
  return *reported;
}

/// A run's end after orders within a trial and the daemon's order to end.
RunView ended_in_a_trial(RunManagerBench& bench,
                         const std::function<void(const std::string&)>& orders) {
  std::atomic<bool> given = false;
  std::string id;
  bench.at_moment = [&](const RunStatusUpdate& moment) {
    if (moment.step != recipes::Step::pressing || given) return;
    bench.posted.post([&] {
      orders(id);
      bench.manager->close();
      given = true;
      given.notify_all();
    });
    given.wait(false);
  };
  id = bench.submit().stored.id();
  return bench.ended(id);
}

constexpr const char* by_the_end = daemon_stopped_error;

}  // namespace

TEST_CASE("a run that a person ended before the daemon was stopped has ended") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  const Order order = GENERATE(Order::stop, Order::abort, Order::halt);
  const RunView run = ended_in_a_trial(bench, [&](const std::string& id) {
    if (order == Order::halt)
      bench.manager->halt(RigState::Stop::halt, "test");
    else
      REQUIRE(bench.manager->order(id, order, "test"));
  });
  CHECK(run.machine.state == RunState::ended);
  CHECK(run.stored.outcome == "aborted");  // a stop would have finished the trial
  CHECK(run.stored.error == (order == Order::stop ? by_the_end : ""));
}

TEST_CASE("a run that the daemon's end has cut is interrupted, whatever is ordered after it") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  const bool is_halted = GENERATE(false, true);
  const RunView run = ended_in_a_trial(bench, [&](const std::string&) {
    bench.manager->close();
    if (is_halted) bench.manager->halt(RigState::Stop::halt, "test");
  });
  CHECK(run.machine.state == RunState::interrupted);
  CHECK(run.stored.outcome == "aborted");
  CHECK(run.stored.error == by_the_end);
}

TEST_CASE("a daemon that ends waits for a run that is being discarded") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  {
    RunManagerBench bench(folder);
    const auto reported = settled_at_the_end(bench, Recovery::discard);
    REQUIRE(reported);
    CHECK(reported->stored.recovered == "discard");
  }
  const StoredRun saved = RunStore::open(folder / "weftd.sqlite")->runs()->front();
  CHECK(saved.state == RunState::ended);
  CHECK(saved.recovered == "discard");
}

TEST_CASE("keeping a part of a run is cancelled by the daemon's end before anything is written") {
  bool gave_way = false;
  // If its thread is faster than this one, the run has been kept.
  for (int i = 0; i < 20 && !gave_way; ++i) {
    const TemporaryFolder folder;
    leave_interrupted(folder);
    RunManagerBench bench(folder);
    const auto reported = settled_at_the_end(bench, Recovery::keep_partial);
    const StoredRun run = bench.manager->loaded().front().stored;
    CHECK(run.recovered == (reported ? "keep-partial" : ""));
    CHECK(run.state == (reported ? RunState::ended : RunState::interrupted));
    gave_way = !reported;
  }
  CHECK(gave_way);
}

TEST_CASE("a daemon that ends accepts nothing new, and reports why") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  RunManager& manager = *bench.manager;
  const std::string id = manager.loaded().front().stored.id();
  REQUIRE(manager.pause_queue("test"));
  CHECK_FALSE(manager.status().is_closing);
  manager.close();
  CHECK(manager.status().is_closing);
  std::vector<Status> refused{manager.resume_queue("test"), manager.reset("looked at it", "test")};
  const auto keep = [&](const Result<RunView>& run) {
    refused.push_back(run ? Status{} : pass(run.error()));
  };
  keep(bench.submit({bench.request.recipe, {}, {}, "test"}));
  keep(bench.recover(id, "test"));
  manager.settle(id, Recovery::discard, "test", keep);
  REQUIRE(refused.size() == 5);
  for (const Status& each : refused) {
    REQUIRE_FALSE(each);
    CHECK(each.error().code == Errc::wrong_state);
    CHECK(each.error().where == "daemon");
  }
  CHECK(manager.loaded().size() == 1);
  CHECK(manager.get(id)->machine.state == RunState::interrupted);
  manager.halt(RigState::Stop::halt, "test");
  CHECK(manager.rig_state().is_latched());
}

}  // namespace weftd_end_test
