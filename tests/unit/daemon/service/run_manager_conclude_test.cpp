// A run with all trials recorded and without data set, because it could not be written: the facts
// about its bench stay known while the run is only concluded. SIMULATED.

#include <atomic>
#include <filesystem>
#include <future>

#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace run_manager_conclude_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::RunManagerBench;
using test::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

using Facts = std::vector<std::string>;
Facts facts_of(const RunView& run) {
  const StoredRun& stored = run.stored;
  return {stored.outcome, stored.cleanup, stored.rig_fact, stored.error, stored.dataset_sha256};
}

fs::path in_the_way(const RunManagerBench& bench) {
  return bench.folder / "R-000001" / "dataset.h5";
}

/// The only run; until its end a file was in the place of its data set.
std::string run_without_dataset(RunManagerBench& bench) {
  bench.at_line = [&](const TrialProgress& line, RunOrders&) {
    if (line.done == line.planned) fs::create_directories(in_the_way(bench) / "a folder");
  };
  const RunView cut = bench.ended(bench.submit().stored.id());
  REQUIRE(cut.machine.state == RunState::interrupted);
  REQUIRE_FALSE(cut.stored.dataset_error.empty());
  bench.at_line = {};
  return cut.stored.id();
}

RunView concluded(RunManagerBench& bench, const std::string& id) {
  fs::remove_all(in_the_way(bench));
  REQUIRE(bench.recover(id, "test"));
  return bench.ended(id);
}

}  // namespace

TEST_CASE("a run without its data set is interrupted, whatever its rig file is when it ends") {
  const TemporaryFolder folder;
  const fs::path in_the_way = folder / "R-000001" / "dataset.h5";
  RunManagerBench bench(folder, test::tiny_recipe(1));
  const std::string rig = test::read_file(bench.request.rig);
  bench.at_line = [&](const TrialProgress& line, RunOrders&) {
    if (line.done < line.planned) return;
    fs::create_directories(in_the_way / "a folder");
    test::write_file(bench.request.rig, rig.substr(0, rig.size() / 2));
  };
  const std::string id = bench.submit().stored.id();
  CHECK(bench.ended(id).machine.state == RunState::interrupted);
  fs::remove_all(in_the_way);
  test::write_file(bench.request.rig, rig);
  REQUIRE(bench.recover(id, "test"));
  const RunView whole = bench.ended(id);
  CHECK(facts_of(whole) == Facts{"complete", "done", "safe", "", whole.stored.dataset_sha256});
  CHECK_FALSE(whole.stored.dataset_sha256.empty());
}

TEST_CASE(
    "how a bench ended, and why, is kept until its run is concluded, whatever comes between") {
  const TemporaryFolder folder;
  std::string id;
  const Error silence{.code = Errc::device, .where = "ft", .what = "no record came"};
  {
    RunManagerBench bench(folder, test::tiny_recipe(1));
    bench.bench_ends = [&](CampaignSummary& summary) {
      summary.outcome = recipes::Outcome::aborted;
      summary.error = silence;
    };
    id = run_without_dataset(bench);
    bench.bench_ends = {};
    bench.rig_file_is_broken = true;
    REQUIRE(bench.recover(id, "test"));
    CHECK(bench.ended(id).stored.error.find("not JSON") != std::string::npos);
    bench.rig_file_is_broken = false;
  }
  RunManagerBench bench(folder, test::tiny_recipe(1));
  REQUIRE(bench.recover(id, "test"));
  CHECK(facts_of(bench.ended(id)) == Facts{"aborted", "done", "safe", to_string(silence), ""});
  REQUIRE(bench.recover(id, "test"));
  const Order order = GENERATE(Order::stop, Order::abort, Order::halt);
  if (order == Order::halt)
    bench.manager->halt(RigState::Stop::halt, "test");
  else
    REQUIRE(bench.manager->order(id, order, "test"));
  CHECK(bench.ended(id).machine.state == RunState::interrupted);
  if (order == Order::halt) REQUIRE(bench.manager->reset("looked at it", "test"));
  const RunView whole = concluded(bench, id);
  CHECK(whole.machine.state == RunState::ended);
  const std::string sha256 = whole.stored.dataset_sha256;
  CHECK(facts_of(whole) == Facts{"aborted", "done", "safe", to_string(silence), sha256});
  CHECK(bench.manager->rig_state() == RigState{});
}

TEST_CASE("a run that does not answer while it only concludes leaves bench and rig as they were") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder, test::tiny_recipe(1));
  const std::string id = run_without_dataset(bench);
  std::promise<void> answers;
  bench.at_start = [&] { answers.get_future().wait(); };
  REQUIRE(bench.recover(id, "test"));
  REQUIRE(bench.manager->order(id, Order::abort, "test"));
  for (int i = 0; i < 2; ++i) {  // up the deadlines: halting, lost
    CHECK_FALSE(bench.manager->status().unresponsive);
    bench.now += std::chrono::hours(1);
    bench.manager->tick();
  }
  CHECK(bench.manager->status().unresponsive == id);
  const RunView lost = *bench.manager->get(id);
  CHECK(lost.machine.state == RunState::ended);
  CHECK(facts_of(lost) == Facts{"complete", "done", "safe", runs::unresponsive_error, ""});
  CHECK_FALSE(lost.stored.dataset_error.empty());
  CHECK(bench.manager->rig_state() == RigState{});
  answers.set_value();
  const auto is_back = [&] {
    return bench.manager->get(id)->machine.state == RunState::interrupted;
  };
  REQUIRE(bench.posted.run_until(is_back));
  CHECK_FALSE(bench.manager->status().unresponsive);
  bench.at_start = {};
  CHECK(bench.manager->rig_state() == RigState{});
  const RunView whole = concluded(bench, id);
  CHECK(whole.machine.state == RunState::ended);
  CHECK(facts_of(whole) == Facts{"complete", "done", "safe", "", whole.stored.dataset_sha256});
}

TEST_CASE("the rig is unknown after a run that became unresponsive") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  std::promise<void> answers;
  std::atomic<bool> has_rig = false;
  bench.at_rig = [&] {
    has_rig = true;
    has_rig.notify_all();
    answers.get_future().wait();
  };
  const std::string id = bench.submit().stored.id();
  REQUIRE(bench.posted.run_until([&] { return !bench.store.runs()->front().rig_untaken; }));
  has_rig.wait(false);
  REQUIRE(bench.manager->order(id, Order::abort, "test"));
  for (int i = 0; i < 2; ++i) {  // up the deadlines: halting, lost
    bench.now += std::chrono::hours(1);
    bench.manager->tick();
  }
  CHECK(bench.manager->get(id)->machine.state == RunState::ended);
  CHECK(bench.manager->rig_state() == RigState{RigFact::unknown, id});
  answers.set_value();
}

TEST_CASE("a run that is lost while it asks for the rig ends as it did before, without it") {
  const TemporaryFolder folder;
  test::leave_interrupted(folder);
  RunManagerBench bench(folder);
  const RunView before = bench.manager->loaded().front();
  const std::string id = before.stored.id();
  REQUIRE(before.stored.outcome == "interrupted");
  bool asks_next = false;
  bench.at_asking = [&] { bench.posted.post([&] { asks_next = true; }); };
  REQUIRE(bench.recover(id, "test"));
  REQUIRE(bench.posted.run_until([&] { return asks_next; }));
  REQUIRE(bench.posted.arrives());  // it has sent the request, which is not answered
  REQUIRE(bench.manager->order(id, Order::abort, "test"));
  for (int i = 0; i < 2; ++i) {  // up the deadlines: halting, lost
    bench.now += std::chrono::hours(1);
    bench.manager->tick();
  }
  const StoredRun lost = bench.manager->get(id)->stored;
  CHECK(lost.error == runs::unresponsive_error);
  CHECK(lost.outcome == "interrupted");
  CHECK(lost.cleanup == before.stored.cleanup);
  CHECK(bench.manager->rig_state() == RigState{RigFact::unknown, id});  // as it was
}

}  // namespace run_manager_conclude_test
