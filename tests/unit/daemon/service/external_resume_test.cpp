// The reported state of a finished run, by the contents of its folder: all trials although its
// bench was aborted, and later changes by others. SIMULATED.

#include <future>

#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace external_resume_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::leave_interrupted;
using test::RunManagerBench;
using test::TemporaryFolder;

namespace {

constexpr std::size_t planned = 4;

/// Like `weft run --resume` in the folder of a run; without the campaign error check.
CampaignSummary resumed_outside(const RunManagerBench& bench, const RunView& run) {
  CampaignRequest request = bench.request;
  request.out = run.stored.folder;
  request.resume = true;
  request.error_check = false;
  const auto summary = run_campaign(request, {});
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

/// Waits until the state of the folder is reported.
bool reports(RunManagerBench& bench, const std::string& id) {
  bench.now += std::chrono::seconds(1);  // the interval of its checks
  bench.manager->tick();
  return bench.posted.run_until(
      [&] { return bench.manager->get(id)->external_resume.has_value(); });
}

/// A run stopped after its first trial.
RunView stopped(RunManagerBench& bench) {
  bench.at_line = [](const TrialProgress&, RunOrders& orders) {
    orders.give({Order::stop, "test"});
  };
  const RunView run = bench.ended(bench.submit().stored.id());
  bench.at_line = {};
  REQUIRE(run.stored.outcome == "stopped");
  REQUIRE(run.trials_done < planned);
  return run;
}

}  // namespace

TEST_CASE("a campaign completed without the daemon is reported as such") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  const RunView before = stopped(bench);
  const std::string id = before.stored.id();
  const CampaignSummary whole = resumed_outside(bench, before);
  REQUIRE(reports(bench, id));
  const RunView now = *bench.manager->get(id);
  CHECK(now.external_resume == ExternalResume{planned, planned, true, whole.dataset_sha256});
  CHECK(now.changed_by == "auto:folder");
  CHECK(now.stored.outcome == "stopped");  // the end of its own bench
  CHECK(now.stored.dataset_sha256 == before.stored.dataset_sha256);
  CHECK(now.trials_done == before.trials_done);
  const auto refused = bench.manager->request_to_recover(id);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().hint.empty());  // no trials remain to resume
}

TEST_CASE("what was completed while no daemon was there is seen by the next one") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  {
    RunManagerBench bench(folder);
    resumed_outside(bench, bench.manager->loaded().front());
  }
  RunManagerBench bench(folder);
  const std::string id = bench.manager->loaded().front().stored.id();
  REQUIRE(reports(bench, id));
  CHECK(bench.manager->get(id)->external_resume->complete);
  CHECK(bench.manager->get(id)->machine.state == RunState::interrupted);
  REQUIRE(bench.recover(id, "test"));  // then the run is the daemon's own
  CHECK_FALSE(bench.manager->get(id)->external_resume);
  const RunView own = bench.ended(id);
  CHECK(own.stored.outcome == "complete");
  bench.now += std::chrono::seconds(1);
  bench.manager->tick();
  CHECK_FALSE(bench.manager->get(id)->external_resume);
}

TEST_CASE("the kept part of a campaign resumed externally is the run's own") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  const std::string id = bench.manager->loaded().front().stored.id();
  resumed_outside(bench, bench.manager->loaded().front());
  REQUIRE(reports(bench, id));
  bool is_settled = false;
  bench.manager->settle(id, Recovery::keep_partial, "test", [&](const Result<RunView>& run) {
    if (!run) FAIL(to_string(run.error()));
    is_settled = true;
  });
  REQUIRE(bench.posted.run_until([&] { return is_settled; }));
  CHECK_FALSE(bench.manager->get(id)->external_resume);
}

TEST_CASE("an untouched folder is the run's own") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  const std::string id = stopped(bench).stored.id();
  bench.now += std::chrono::seconds(1);
  bench.manager->tick();
  REQUIRE(bench.posted.arrives());
  bool is_seen = false;
  bench.posted.post([&] { is_seen = true; });
  REQUIRE(bench.posted.run_until([&] { return is_seen; }));
  CHECK_FALSE(bench.manager->get(id)->external_resume);
}

TEST_CASE("a daemon that is ended in the retreat after the last trial has all of its trials") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  bench.at_moment = [&](const RunStatusUpdate& moment) {
    if (moment.step != recipes::Step::retracting || moment.trial + 1 < planned) return;
    std::promise<void> closed;
    bench.posted.post([&] {
      bench.manager->close();
      closed.set_value();
    });
    closed.get_future().wait();
  };
  const RunView run = bench.ended(bench.submit().stored.id());
  CHECK(run.machine.state == RunState::ended);
  CHECK(run.stored.outcome == "aborted");
  CHECK(run.stored.cleanup == "done");
  CHECK(run.stored.has_all());
  CHECK(run.trials_done == planned);
  CHECK_FALSE(run.stored.dataset_sha256.empty());
}

}  // namespace external_resume_test
