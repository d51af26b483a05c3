// The facts about a run's end, its campaign's place and its thread. SIMULATED.

#include <filesystem>
#include <fstream>

#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace run_manager_facts_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::leave_interrupted;
using test::RunManagerBench;
using test::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

std::string only_run(const RunManagerBench& bench) {
  return bench.manager->loaded().front().stored.id();
}

/// Resumes the only run until `trials` trials are complete, and stops it there.
RunView stopped_at(RunManagerBench& bench, std::size_t trials) {
  bench.at_line = [trials](const TrialProgress& line, RunOrders& orders) {
    if (line.done == trials) orders.give({Order::stop, "test"});
  };
  REQUIRE(bench.recover(only_run(bench), "test"));
  const RunView run = bench.ended(only_run(bench));
  bench.at_line = {};
  return run;
}

using Facts = std::vector<std::string>;
Facts facts_of(const RunView& run) {
  const StoredRun& stored = run.stored;
  return {stored.outcome, stored.cleanup, stored.rig_fact, stored.error, stored.dataset_sha256};
}

std::size_t address_space_mb() {
  std::ifstream file("/proc/self/statm");
  std::size_t pages = 0;
  REQUIRE(file >> pages);
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) / 1'000'000;
}

}  // namespace

TEST_CASE("an accuracy is held only if the run's own check confirms it") {
  for (const bool held : {false, true}) {
    const TemporaryFolder folder;
    RunManagerBench bench(folder, test::tiny_recipe(1));
    bench.bench_ends = [held](CampaignSummary& summary) {  // the run's end was not written
      summary.simulation.promise = SimulationPromise{.requested_n = 0.1, .held = held};
    };
    const std::string id = bench.submit().stored.id();
    CHECK(bench.ended(id).stored.promise == (held ? "held" : "missed"));
  }
}

TEST_CASE("a resumed run has no end, and has its former one again after it is withdrawn") {
  const TemporaryFolder folder;
  leave_interrupted(folder, 4);
  Facts before;
  {
    RunManagerBench bench(folder, test::tiny_recipe(4));
    const RunView stopped = stopped_at(bench, 4);
    REQUIRE(stopped.machine.state == RunState::interrupted);
    before = facts_of(stopped);
    CHECK(stopped.stored.outcome == "stopped");
    CHECK_FALSE(stopped.stored.dataset_sha256.empty());
    REQUIRE(bench.manager->pause_queue("test"));
    const auto waits = bench.recover(only_run(bench), "test");
    REQUIRE(waits);
    CHECK(facts_of(*waits) == Facts(5));
    CHECK(facts_of(*bench.manager->get(only_run(bench))) == Facts(5));
  }
  RunManagerBench bench(folder, test::tiny_recipe(4));
  CHECK(facts_of(*bench.manager->get(only_run(bench))) == Facts(5));
  REQUIRE(bench.manager->remove(only_run(bench), "test"));
  const RunView removed_from_queue = *bench.manager->get(only_run(bench));
  CHECK(removed_from_queue.machine.state == RunState::interrupted);
  CHECK(facts_of(removed_from_queue) == before);
}

TEST_CASE("a resume without changes keeps the data set; one with new trials makes its own") {
  const TemporaryFolder folder;
  leave_interrupted(folder, 4);
  RunManagerBench bench(folder, test::tiny_recipe(4));
  const std::string saved = stopped_at(bench, 4).stored.dataset_sha256;
  REQUIRE_FALSE(saved.empty());
  const RunView replayed = stopped_at(bench, 1);
  CHECK(replayed.stored.dataset_error.find("resume") != std::string::npos);
  CHECK(facts_of(replayed) == Facts{"stopped", "done", "safe", "", saved});
  REQUIRE(bench.recover(only_run(bench), "test"));
  const RunView whole = bench.ended(only_run(bench));
  CHECK(whole.stored.outcome == "complete");
  CHECK_FALSE(whole.stored.dataset_sha256.empty());
  CHECK(whole.stored.dataset_sha256 != saved);
}

TEST_CASE("a data set that cannot be written changes nothing of how the bench ended") {
  const TemporaryFolder folder;
  const fs::path in_the_way = folder / "R-000001" / "dataset.h5";
  std::string id;
  {
    RunManagerBench bench(folder, test::tiny_recipe(1));
    bench.at_line = [&](const TrialProgress& line, RunOrders&) {
      if (line.done == line.planned) fs::create_directories(in_the_way / "a folder");
    };
    id = bench.submit().stored.id();
    const RunView run = bench.ended(id);
    CHECK(facts_of(run) == Facts{"complete", "done", "safe", "", ""});
    CHECK(run.stored.dataset_error.find(in_the_way.string()) != std::string::npos);
    CHECK(run.machine.state == RunState::interrupted);  // its data set can still be made
    CHECK(bench.manager->rig_state() == RigState{});
  }
  RunManagerBench bench(folder, test::tiny_recipe(1));
  CHECK_FALSE(bench.manager->get(id)->stored.dataset_error.empty());
  for (int i = 0; i < 2; ++i) {
    REQUIRE(bench.recover(id, "test"));
    const RunView again = bench.ended(id);
    CHECK(again.machine.state == RunState::interrupted);
    CHECK(facts_of(again) == Facts{"complete", "done", "safe", "", ""});
    CHECK(again.stored.dataset_error.find(in_the_way.string()) != std::string::npos);
  }
  bench.rig_file_is_broken = true;
  REQUIRE(bench.recover(id, "test"));
  const RunView refused = bench.ended(id);
  CHECK(facts_of(refused) == Facts{"complete", "done", "safe", refused.stored.error, ""});
  CHECK(refused.stored.error.find("not JSON") != std::string::npos);
  CHECK_FALSE(refused.stored.dataset_error.empty());
  bench.rig_file_is_broken = false;
  fs::remove_all(in_the_way);
  REQUIRE(bench.recover(id, "test"));
  const RunView whole = bench.ended(id);
  CHECK(whole.machine.state == RunState::ended);
  CHECK(whole.stored.dataset_error.empty());
  CHECK_FALSE(whole.stored.dataset_sha256.empty());
  CHECK(facts_of(whole) == Facts{"complete", "done", "safe", "", whole.stored.dataset_sha256});
}

TEST_CASE("while the daemon's folder is away nothing of the line begins, and nothing is lost") {
  const TemporaryFolder folder;
  const fs::path away = folder.path().string() + "-away";
  RunManagerBench bench(folder, test::tiny_recipe(1));
  bench.at_line = [&](const TrialProgress& line, RunOrders&) {
    if (line.done == line.planned) fs::rename(folder.path(), away);
  };
  const std::string first = bench.submit().stored.id(), second = bench.submit().stored.id();
  const RunView cut = bench.ended(first);
  CHECK(facts_of(cut) == Facts{"complete", "done", "safe", "", ""});
  CHECK_FALSE(cut.stored.dataset_error.empty());
  CHECK(cut.machine.state == RunState::interrupted);  // its data set can still be made
  bench.manager->tick();
  CHECK(bench.manager->get(second)->machine.state == RunState::queued);
  CHECK(bench.manager->queue().is_paused());
  CHECK_FALSE(fs::exists(folder.path()));
  bench.at_line = {};
  fs::rename(away, folder.path());
  bench.manager->tick();
  CHECK_FALSE(bench.manager->active());
  REQUIRE(bench.manager->resume_queue("test"));
  CHECK(bench.ended(second).stored.outcome == "complete");
  REQUIRE(bench.recover(first, "test"));
  const RunView whole = bench.ended(first);
  CHECK(whole.machine.state == RunState::ended);
  CHECK(facts_of(whole) == Facts{"complete", "done", "safe", "", whole.stored.dataset_sha256});
  CHECK_FALSE(whole.stored.dataset_sha256.empty());
}

TEST_CASE("a run that waits for room on the disk is not lost, and begins by a person's order") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder, test::tiny_recipe(1));
  bench.at_line = [&](const TrialProgress& line, RunOrders&) {
    if (line.done == line.planned) bench.disk_is_full = true;
  };
  const std::string first = bench.submit().stored.id(), second = bench.submit().stored.id();
  bench.ended(first);
  bench.manager->tick();
  CHECK(bench.manager->get(second)->machine.state == RunState::queued);
  CHECK(bench.manager->queue().paused_by() == "auto:disk");
  CHECK(bench.manager->status().bytes_awaited > 0);
  bench.at_line = {};
  bench.disk_is_full = false;
  bench.manager->tick();
  CHECK_FALSE(bench.manager->active());
  REQUIRE(bench.manager->resume_queue("test"));
  CHECK(bench.ended(second).stored.outcome == "complete");
  CHECK(bench.manager->status().bytes_awaited == 0);
}

TEST_CASE("a run of which it cannot be kept that it has the rig does not take it") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder, test::tiny_recipe(1));
  bool has_rig = false;
  bench.at_rig = [&] { has_rig = true; };
  const std::string id = bench.submit().stored.id();  // its thread sends a request, which is
                                                      // answered below
  const fs::path file = folder / "weftd.sqlite", away = folder / "away.sqlite";
  fs::rename(file, away);
  const RunView run = bench.ended(id);
  fs::rename(away, file);
  CHECK_FALSE(has_rig);
  CHECK(run.stored.outcome == "failed");
  CHECK(run.stored.error.find("not started") != std::string::npos);
  CHECK(run.stored.rig_fact == "safe");
  CHECK(bench.manager->rig_state() == RigState{});
}

TEST_CASE("withdrawing a run that never began does not change the rig") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  bench.manager->halt(RigState::Stop::halt, "test");
  const std::string id = bench.submit().stored.id();
  REQUIRE(bench.manager->remove(id, "test"));
  CHECK(bench.manager->get(id)->stored.rig_fact == "safe");
}

TEST_CASE("a daemon's folder may be moved: its runs are found in it and go on there") {
  const TemporaryFolder before, after;
  leave_interrupted(before);
  for (const auto& entry : fs::directory_iterator(before.path()))
    if (entry.path().filename() == "R-000001" ||
        entry.path().filename().string().starts_with("weftd.sqlite"))
      fs::rename(entry.path(), after / entry.path().filename().string());
  RunManagerBench bench(after);
  const RunView found = *bench.manager->get(only_run(bench));
  CHECK(found.stored.folder == after / "R-000001");
  CHECK(found.trials_done >= 2);
  REQUIRE(bench.recover(found.stored.id(), "test"));
  CHECK(bench.ended(found.stored.id()).stored.outcome == "complete");
  CHECK(fs::exists(after / "R-000001" / "dataset.h5"));
  CHECK_FALSE(fs::exists(before / "R-000001"));
}

TEST_CASE("a folder as an older daemon kept it is found where its name is") {
  const TemporaryFolder folder;
  const std::string file = (folder / "weftd.sqlite").string();
  const std::string saved = GENERATE("/gone/R-000001", "out/lab/R-000001", "R-000001");
  {
    RunStore store = std::move(RunStore::open(file).value());
    StoredRun run;
    run.folder = saved;
    REQUIRE(test::add(store, run));
  }
  const fs::path here = folder / "R-000001";
  fs::create_directory(here);
  CHECK(RunStore::open(file)->runs()->front().folder == here);
}

TEST_CASE("a run with a missing campaign is not started again") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  fs::rename(folder / "R-000001", folder / "elsewhere");
  const auto refused = bench.recover(only_run(bench), "test");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::not_found);
  CHECK(bench.manager->get(only_run(bench))->machine.state == RunState::interrupted);
  fs::rename(folder / "elsewhere", folder / "R-000001");
  CHECK(bench.recover(only_run(bench), "test"));
}

TEST_CASE("a run with a campaign missing at the daemon's start waits until it is back") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  const fs::path campaign = folder / "R-000001", elsewhere = folder / "elsewhere";
  fs::rename(campaign, elsewhere);
  RunManagerBench bench(folder);
  CHECK_FALSE(bench.recover(only_run(bench), "test"));
  fs::rename(elsewhere, campaign);
  REQUIRE(bench.manager->pause_queue("test"));
  REQUIRE(bench.recover(only_run(bench), "test"));
  CHECK(bench.manager->get(only_run(bench))->trials_done >= 2);
  fs::rename(campaign, elsewhere);  // the run is queued
  REQUIRE(bench.manager->resume_queue("test"));
  const RunView refused = bench.ended(only_run(bench));
  CHECK(refused.machine.state == RunState::interrupted);
  CHECK(refused.stored.error.find("missing") != std::string::npos);
  CHECK_FALSE(fs::exists(campaign));
}

TEST_CASE("a folder of the same name elsewhere is not used as a run's") {
  const TemporaryFolder folder, other;
  {
    RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
    StoredRun run;
    run.folder = folder / "R-000001";
    REQUIRE(test::add(store, run));
  }
  fs::create_directory(other / "R-000001");
  const fs::path before = fs::current_path();
  fs::current_path(other.path());
  const fs::path found = RunStore::open(folder / "weftd.sqlite")->runs()->front().folder;
  fs::current_path(before);
  CHECK(found == folder / "R-000001");
}

TEST_CASE("a bench that does not come up costs one run; the others wait for a word") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  REQUIRE(bench.manager->pause_queue("test"));
  const std::string first = bench.submit().stored.id(), second = bench.submit().stored.id();
  bench.no_bench_comes_up = true;
  REQUIRE(bench.manager->resume_queue("test"));
  CHECK(bench.ended(first).stored.outcome == "failed");
  CHECK(bench.manager->get(second)->machine.state == RunState::queued);
  CHECK(bench.manager->queue().paused_by() == "auto:failed");
  bench.no_bench_comes_up = false;
  REQUIRE(bench.manager->resume_queue("test"));
  CHECK(bench.ended(second).stored.outcome == "complete");
  bench.no_bench_comes_up = true;
  CHECK(bench.ended(bench.submit().stored.id()).stored.outcome == "failed");
  CHECK_FALSE(bench.manager->queue().is_paused());  // no run waits
}

TEST_CASE("a rig file that is damaged while runs wait costs none of them") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder, test::tiny_recipe(1));
  const std::string rig = test::read_file(bench.request.rig);
  REQUIRE(bench.manager->pause_queue("test"));
  const std::string first = bench.submit().stored.id(), second = bench.submit().stored.id();
  const bool is_gone = GENERATE(true, false);
  if (is_gone)
    fs::remove(bench.request.rig);
  else
    test::write_file(bench.request.rig, rig.substr(0, rig.size() / 2));
  for (int i = 0; i < 2; ++i) {
    REQUIRE(bench.manager->resume_queue("test"));
    CHECK_FALSE(bench.manager->active());
    CHECK(bench.manager->queue().runs() == std::vector<std::int64_t>{1, 2});
    CHECK(bench.manager->queue().paused_by() == "auto:rig_file");
    const JournalLine newest = bench.store.tail("", 1)->front();
    CHECK(newest.kind == "queue_paused");
    CHECK(newest.payload_json.find(bench.request.rig.string()) != std::string::npos);
  }
  test::write_file(bench.request.rig, rig);
  REQUIRE(bench.manager->resume_queue("test"));
  for (const std::string& id : {first, second}) CHECK(bench.ended(id).stored.outcome == "complete");
}

TEST_CASE("a run that waits begins on the rig of the daemon that begins it, never on another") {
  const TemporaryFolder folder;
  {
    RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
    StoredRun run;
    run.recipe = test::request_in(folder, test::tiny_recipe(1)).recipe;
    run.rig = folder / "another-rig.json";
    run.folder = folder / "R-000001";
    REQUIRE(test::add(store, run));
    RunQueue queue;
    queue.put(run.number, 0);
    REQUIRE(store.commit({.queue = queue}));
  }
  RunManagerBench bench(folder, test::tiny_recipe(1));
  CHECK(bench.manager->queue().is_paused());
  REQUIRE(bench.manager->resume_queue("test"));
  const RunView ended = bench.ended("R-000001");
  CHECK(ended.stored.outcome == "complete");
  CHECK(ended.stored.rig == bench.request.rig);
}

TEST_CASE("a run that was stopped, aborted or failed is recovered as an interrupted one is") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  const auto order =
      GENERATE(std::optional(Order::stop), std::optional(Order::abort), std::optional<Order>());
  bench.at_line = [&](const TrialProgress& line, RunOrders& orders) {
    if (line.done != 1) return;
    if (!order) throw std::runtime_error("the bench breaks");
    orders.give({*order, "test"});
  };
  const std::string id = bench.submit().stored.id();
  const RunView cut = bench.ended(id);
  REQUIRE(cut.machine.state == RunState::ended);
  REQUIRE(cut.trials_done < cut.trials_planned);
  bench.at_line = {};
  const auto refused = bench.manager->order(id, Order::resume, "test");
  CHECK(refused.error().hint.find("weft recover " + id) != std::string::npos);
  if (!order) REQUIRE(bench.manager->reset("looked at it", "test"));
  REQUIRE(bench.manager->pause_queue("test"));
  REQUIRE(bench.recover(id, "test"));
  REQUIRE(bench.manager->remove(id, "test"));  // back to its earlier state
  const RunView removed = bench.manager->get(id).value();
  CHECK(removed.machine.state == RunState::ended);
  CHECK(facts_of(removed) == facts_of(cut));
  REQUIRE(bench.recover(id, "test"));
  REQUIRE(bench.manager->resume_queue("test"));
  const RunView whole = bench.ended(id);
  CHECK(whole.machine.state == RunState::ended);
  CHECK(whole.stored.outcome == "complete");
  CHECK(whole.trials_done == cut.trials_planned);
  CHECK_FALSE(whole.stored.dataset_sha256.empty());
  CHECK(bench.recover(id, "test").error().code == Errc::wrong_state);
}

TEST_CASE("a run that was aborted is discarded, and never recovered after that") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  bench.at_line = [](const TrialProgress&, RunOrders& orders) {
    orders.give({Order::abort, "test"});
  };
  const std::string id = bench.submit().stored.id();
  REQUIRE(bench.ended(id).machine.state == RunState::ended);
  const auto settled = [&](Recovery choice) {
    std::optional<Result<RunView>> reply;
    bench.manager->settle(id, choice, "test", [&](const Result<RunView>& run) { reply = run; });
    REQUIRE(bench.posted.run_until([&] { return reply.has_value(); }));
    return *reply;
  };
  CHECK(settled(Recovery::keep_partial).error().code == Errc::wrong_state);  // it has a data set
  const auto discarded = settled(Recovery::discard);
  REQUIRE(discarded);
  CHECK(discarded->stored.recovered == "discard");
  CHECK(bench.recover(id, "test").error().code == Errc::wrong_state);
  CHECK(bench.store.run(discarded->stored.number).value()->recovered == "discard");  // stored
}

TEST_CASE("a run that is over leaves no thread behind") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder, test::tiny_recipe(1));
  const auto run_some = [&](int runs) {
    for (int i = 0; i < runs; ++i) bench.ended(bench.submit().stored.id());
    return address_space_mb();
  };
  const std::size_t before = run_some(3);
  CHECK(run_some(10) < before + 40);  // the stack of a thread is 8 MB
}

}  // namespace run_manager_facts_test
