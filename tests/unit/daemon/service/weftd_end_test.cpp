// What becomes of what is under way where the daemon is told to end. SIMULATED.

#include "tests/unit/daemon/service/desk_bench.hpp"

namespace weftd_end_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::control;
using test::DeskBench;
using test::leave_interrupted;
using test::TemporaryFolder;

namespace {

/// What is told of a choice that was made just before the daemon was told to end.
Result<RunView> settled_at_the_end(DeskBench& bench, Recovery choice) {
  std::optional<Result<RunView>> told;
  const std::string id = bench.desk->all().front().stored.id();
  bench.desk->settle(id, choice, "test", [&](const Result<RunView>& run) { told = run; });
  bench.desk->close();
  CHECK_FALSE(bench.desk->is_at_rest());
  REQUIRE(bench.posted.run_until([&] { return told.has_value(); }));
  CHECK(bench.desk->is_at_rest());
  return *told;
}

/// A run's end, where somebody gave it orders within a trial and the daemon was told to end then.
RunView ended_in_a_trial(DeskBench& bench, const std::function<void(const std::string&)>& orders) {
  std::atomic<bool> given = false;
  std::string id;
  bench.at_moment = [&](const RunMoment& moment) {
    if (moment.step != recipes::Step::pressing || given) return;
    bench.posted.post([&] {
      orders(id);
      bench.desk->close();
      given = true;
      given.notify_all();
    });
    given.wait(false);
  };
  id = bench.submit().stored.id();
  return bench.ended(id);
}

constexpr const char* by_the_end = "aborted by the daemon, which was told to end";

}  // namespace

TEST_CASE("a run that somebody had ended before the daemon was told to has ended") {
  const TemporaryFolder folder;
  DeskBench bench(folder);
  const Order order = GENERATE(Order::stop, Order::abort, Order::halt);
  const RunView run = ended_in_a_trial(bench, [&](const std::string& id) {
    if (order == Order::halt)
      bench.desk->halt("test");
    else
      REQUIRE(bench.desk->order(id, order, "test"));
  });
  CHECK(run.machine.state == RunState::ended);
  CHECK(run.stored.outcome == "aborted");  // a stop would have finished the trial
  CHECK(run.stored.error == (order == Order::stop ? by_the_end : ""));
}

TEST_CASE("a run that the daemon's end has cut is interrupted, whatever is ordered after it") {
  const TemporaryFolder folder;
  DeskBench bench(folder);
  const bool is_halted = GENERATE(false, true);
  const RunView run = ended_in_a_trial(bench, [&](const std::string&) {
    bench.desk->close();
    if (is_halted) bench.desk->halt("test");
  });
  CHECK(run.machine.state == RunState::interrupted);
  CHECK(run.stored.outcome == "aborted");
  CHECK(run.stored.error == by_the_end);
}

TEST_CASE("a daemon that ends waits for a run that is being discarded") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  {
    DeskBench bench(folder);
    const auto told = settled_at_the_end(bench, Recovery::discard);
    REQUIRE(told);
    CHECK(told->stored.recovered == "discard");
  }
  const StoredRun kept = RunStore::open(folder / "weftd.sqlite")->load()->front();
  CHECK(kept.state == RunState::ended);
  CHECK(kept.recovered == "discard");
}

TEST_CASE("keeping a part of a run gives way to the daemon's end before it has written anything") {
  bool gave_way = false;
  // Where its thread is done before this one goes on, it has been kept.
  for (int i = 0; i < 20 && !gave_way; ++i) {
    const TemporaryFolder folder;
    leave_interrupted(folder);
    DeskBench bench(folder);
    const auto told = settled_at_the_end(bench, Recovery::keep_partial);
    const StoredRun run = bench.desk->all().front().stored;
    CHECK(run.recovered == (told ? "keep-partial" : ""));
    CHECK(run.state == (told ? RunState::ended : RunState::interrupted));
    gave_way = !told;
  }
  CHECK(gave_way);
}

TEST_CASE("a daemon that ends takes nothing more on, and says why") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  DeskBench bench(folder);
  RunDesk& desk = *bench.desk;
  const std::string id = desk.all().front().stored.id();
  REQUIRE(desk.hold_line("test"));
  CHECK_FALSE(desk.is_closing());
  desk.close();
  CHECK(desk.is_closing());
  std::vector<Status> refused{desk.start_line("test"), desk.reset("looked at it", "test")};
  const auto keep = [&](const Result<RunView>& run) {
    refused.push_back(run ? Status{} : pass(run.error()));
  };
  keep(desk.submit({bench.request.recipe, {}, {}, "test"}));
  keep(desk.recover(id, "test"));
  desk.settle(id, Recovery::discard, "test", keep);
  REQUIRE(refused.size() == 5);
  for (const Status& each : refused) {
    REQUIRE_FALSE(each);
    CHECK(each.error().code == Errc::wrong_state);
    CHECK(each.error().what.find("told to end") != std::string::npos);
  }
  CHECK(desk.all().size() == 1);
  CHECK(desk.get(id)->machine.state == RunState::interrupted);
  desk.halt("test");
  CHECK(desk.standing().fact == RigStanding::Fact::latched);
}

}  // namespace weftd_end_test
