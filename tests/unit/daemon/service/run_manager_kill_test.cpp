// A daemon's run manager killed at every write to its own database and to the campaign file: a
// reported run exists again, and its data equal those of an undisturbed one. SIMULATED.

#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"
#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace run_manager_kill_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::RunManagerBench;
using test::TemporaryFolder;
using test::tiny_recipe;

namespace {

/// The last messages of a child, in memory that outlives it.
class LastWords {
 public:
  LastWords() = default;
  LastWords(const LastWords&) = delete;
  LastWords& operator=(const LastWords&) = delete;
  ~LastWords() { munmap(shared_, sizeof(Facts)); }
  struct Facts {
    std::atomic<bool> submitted, asks_for_rig, has_rig, complete;
  };
  [[nodiscard]] Facts& facts() const { return *static_cast<Facts*>(shared_); }

 private:
  void* shared_ =
      mmap(nullptr, sizeof(Facts), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
};

/// Runs the work in a child that dies at the point. True if it died; false if it finished the work
/// with status 0.
bool killed_in(test::KillPoint point, const std::function<int()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    test::killing::begin(point);
    _exit(work());
  }
  int status = 0;
  REQUIRE(child > 0);
  REQUIRE(waitpid(child, &status, 0) == child);
  const bool killed = WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
  INFO("status " << status);
  REQUIRE((killed || (WIFEXITED(status) && WEXITSTATUS(status) == 0)));
  return killed;
}

/// Opens a run manager, submits a run and waits for it.
bool killed_at_manager(const TemporaryFolder& folder, test::KillPoint point,
                       const LastWords& reported) {
  return killed_in(point, [&] {
    RunManagerBench bench(folder, tiny_recipe(1));
    bench.at_asking = [&reported] { reported.facts().asks_for_rig = true; };
    bench.at_rig = [&reported] { reported.facts().has_rig = true; };
    const auto run = bench.submit({bench.request.recipe, {}, {}, "test"});
    if (!run) return 2;
    reported.facts().submitted = true;
    const std::string id = run->stored.id();
    const auto over = [&] { return bench.manager->get(id)->machine.state == RunState::ended; };
    if (!bench.posted.run_until(over)) return 3;
    reported.facts().complete = bench.manager->get(id)->stored.outcome == "complete";
    return reported.facts().complete ? 0 : 4;
  });
}

const Dataset& untouched_run() {
  static const Dataset known = [] {
    const TemporaryFolder folder;
    const auto summary = run_campaign(test::request_in(folder, tiny_recipe(1)), {});
    if (!summary) FAIL(to_string(summary.error()));
    return load_campaign(summary->campaign_file, {}).value();
  }();
  return known;
}

/// The next daemon in that folder: each run has ended complete, or is interrupted and can be
/// resumed.
void inspect_again(const TemporaryFolder& folder, const LastWords& reported) {
  RunManagerBench bench(folder, tiny_recipe(1));
  const auto found = bench.manager->loaded();
  REQUIRE(found.size() <= 1);
  if (reported.facts().submitted) REQUIRE(found.size() == 1);
  const std::string id = found.empty() ? bench.submit().stored.id() : found.front().stored.id();
  // A run that waited when the daemon died still waits for a user's order.
  if (bench.manager->queue().is_paused()) REQUIRE(bench.manager->resume_queue("test"));
  RunView run = bench.ended(id);
  if (reported.facts().complete) REQUIRE(run.machine.state == RunState::ended);
  if (run.machine.state == RunState::interrupted) {
    const RigState unknown{RigFact::unknown, id};
    if (reported.facts().has_rig) CHECK(bench.manager->rig_state() == unknown);
    if (!reported.facts().asks_for_rig) CHECK(bench.manager->rig_state() == RigState{});
    if (bench.manager->rig_state() != unknown) CHECK(bench.manager->rig_state() == RigState{});
    const auto recovered = bench.recover(id, "test");
    if (!recovered) FAIL(to_string(recovered.error()));
    run = bench.ended(id);
  }
  INFO(run.stored.error);
  CHECK(run.machine.state == RunState::ended);
  CHECK(run.stored.outcome == "complete");
  const auto report = verify(run.stored.folder);
  REQUIRE(report);
  CHECK((report->holds() && report->certified));
  CHECK(report->attempts <= report->complete + 1);
  const auto data = load_campaign(run.stored.folder / campaign_file_name, {});
  REQUIRE(data);
  CHECK(test::difference(untouched_run(), *data) == "");
}

}  // namespace

TEST_CASE("a daemon killed at any write knows the reported run and brings it to its end") {
  (void)untouched_run();
  const std::uint64_t step = test::writes_between_kills();
  std::uint64_t write = 1;
  for (bool killed = true; killed; write += step) {
    const TemporaryFolder folder;
    const LastWords reported;
    INFO("write " << write);
    killed = killed_at_manager(folder, {write, write % 2 == 0}, reported);
    inspect_again(folder, reported);
  }
  WARN("SIMULATED, " << write - step
                     << " writes of a daemon, killed at each or, by day, each third");
  CHECK(write > 60);
}

TEST_CASE("a daemon killed while a run only concludes leaves rig and run as they were") {
  const TemporaryFolder folder;
  const auto in_the_way = folder / "R-000001" / "dataset.h5";
  const std::string id = "R-000001";
  {
    RunManagerBench bench(folder, tiny_recipe(1));
    bench.at_line = [&](const TrialProgress& line, RunOrders&) {
      if (line.done == line.planned) std::filesystem::create_directories(in_the_way / "a folder");
    };
    REQUIRE(bench.ended(bench.submit().stored.id()).machine.state == RunState::interrupted);
  }
  std::uint64_t points = 0;
  for (bool killed = true; killed; ++points) {
    INFO("write " << points + 1);
    killed = killed_in({points + 1, points % 2 == 1}, [&] {
      RunManagerBench bench(folder, tiny_recipe(1));
      if (!bench.recover(id, "test")) return 2;
      const auto over = [&] {
        return bench.manager->get(id)->machine.state == RunState::interrupted;
      };
      return bench.posted.run_until(over) ? 0 : 3;
    });
    RunManagerBench bench(folder, tiny_recipe(1));
    if (bench.manager->queue().is_paused())
      REQUIRE(bench.manager->remove(id, "test"));  // it was queued
    const RunView run = *bench.manager->get(id);
    CHECK(bench.manager->rig_state() == RigState{});
    CHECK(run.machine.state == RunState::interrupted);
    CHECK(run.stored.outcome == "complete");
    CHECK(run.stored.cleanup == "done");
    CHECK(run.stored.rig_fact == "safe");
    CHECK(run.stored.dataset_error.find(in_the_way.string()) != std::string::npos);
    CHECK(run.trials_done == 2);
  }
  CHECK(points > 10);
  std::filesystem::remove_all(in_the_way);
  RunManagerBench bench(folder, tiny_recipe(1));
  REQUIRE(bench.recover(id, "test"));
  const RunView whole = bench.ended(id);
  CHECK(whole.machine.state == RunState::ended);
  CHECK(whole.stored.cleanup == "done");
}

}  // namespace run_manager_kill_test
