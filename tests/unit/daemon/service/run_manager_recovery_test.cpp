// The run manager of weftd resumes runs that were interrupted. SIMULATED.

#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace run_manager_recovery_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::leave_interrupted;
using test::RunManagerBench;
using test::TemporaryFolder;

TEST_CASE("a run with a failed recovery can be recovered again") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  const std::string id = bench.manager->loaded().front().stored.id();
  REQUIRE(bench.ended(id).machine.state == RunState::interrupted);
  const std::string recipe = test::read_file(bench.request.recipe);
  test::write_file(bench.request.recipe, test::tiny_recipe(3));
  REQUIRE(bench.recover(id, "test"));
  const RunView refused = bench.ended(id);
  CHECK(refused.machine.state == RunState::interrupted);
  CHECK(refused.stored.error.find("recipe") != std::string::npos);
  test::write_file(bench.request.recipe, recipe);
  bench.posted.hold();
  REQUIRE(bench.recover(id, "test"));
  REQUIRE(bench.manager->order(id, Order::abort, "test"));
  bench.posted.let_go();
  const RunView aborted = bench.ended(id);
  CHECK(aborted.machine.state == RunState::interrupted);
  CHECK(aborted.stored.outcome == "aborted");
  REQUIRE(bench.recover(id, "test"));
  const RunView done = bench.ended(id);
  CHECK(done.machine.state == RunState::ended);
  CHECK(done.stored.outcome == "complete");
  CHECK(done.trials_done == 4);
  CHECK_FALSE(bench.recover(id, "test"));
}

TEST_CASE("a stopped daemon records the end of a run, which can be resumed") {
  const TemporaryFolder folder;
  {
    RunManagerBench bench(folder, test::tiny_recipe(4));
    bench.at_line = [&](const TrialProgress& line, RunOrders&) {
      if (line.done == 2) bench.posted.post([&] { bench.manager->close(); });
    };
    const std::string first = bench.submit().stored.id(), second = bench.submit().stored.id();
    const RunView cut = bench.ended(first);
    CHECK(cut.machine.state == RunState::interrupted);
    CHECK(cut.stored.outcome == "aborted");
    CHECK(cut.stored.cleanup == "done");
    CHECK_FALSE(bench.manager->active());
    CHECK(bench.manager->get(second)->machine.state == RunState::queued);
  }
  RunManagerBench bench(folder, test::tiny_recipe(4));
  CHECK(bench.manager->rig_state().facts().fact == RigFact::safe);
  const std::string id = bench.manager->loaded().front().stored.id();
  CHECK(bench.manager->get(id)->stored.outcome == "aborted");
  REQUIRE(bench.recover(id, "test"));
  REQUIRE(bench.manager->resume_queue("test"));
  CHECK(bench.ended(id).stored.outcome == "complete");
}

TEST_CASE("a run with a resume aborted during the replay counts the recorded trials") {
  const TemporaryFolder folder;
  leave_interrupted(folder, 4, 3);
  RunManagerBench bench(folder, test::tiny_recipe(4));
  const std::string id = bench.manager->loaded().front().stored.id();
  const std::size_t on_record = bench.manager->get(id).value().trials_done;
  REQUIRE(on_record > 2);
  bench.at_line = [](const TrialProgress&, RunOrders& orders) {
    orders.give({Order::abort, "test"});
  };
  REQUIRE(bench.recover(id, "test"));
  const RunView aborted = bench.ended(id);
  CHECK(aborted.machine.state == RunState::interrupted);
  CHECK(aborted.stored.dataset_error.find("resume") != std::string::npos);
  CHECK(aborted.stored.rig_fact == "safe");
  CHECK(aborted.trials_done == on_record);
  bench.at_line = {};
  REQUIRE(bench.recover(id, "test"));
  CHECK(bench.ended(id).trials_done == 8);
}

TEST_CASE("a run that is withdrawn before it goes on is as interrupted as it was") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  const std::string id = bench.manager->loaded().front().stored.id();
  bench.manager->halt(RigState::Stop::halt, "test");  // no run starts on a latched rig
  REQUIRE(bench.recover(id, "test"));
  REQUIRE(bench.manager->remove(id, "test"));
  CHECK(bench.manager->get(id).value().stored.outcome == "interrupted");
  REQUIRE(bench.recover(id, "test"));
  CHECK(bench.manager->get(id).value().machine.state == RunState::queued);
}

TEST_CASE(
    "the run manager keeps working during a preview of a campaign, and answers all requests") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  const std::string id = bench.manager->loaded().front().stored.id();
  std::vector<ResumePreview> reported;
  const auto query = [&] {
    bench.manager->preview(id, Recovery::resume, [&](const Result<ResumePreview>& left) {
      REQUIRE(left);
      reported.push_back(*left);
    });
  };
  bench.posted.hold();
  query();
  query();
  CHECK(reported.empty());  // the check takes as long as the test holds it
  bench.manager->halt(RigState::Stop::halt, "test");
  bench.manager->tick();
  CHECK(bench.manager->rig_state().is_latched());
  bench.posted.let_go();
  REQUIRE(bench.posted.run_until([&] { return reported.size() == 2; }));
  CHECK(reported[0].planned == 4);
  CHECK(reported[0].complete >= 2);
  CHECK(reported[1].will == reported[0].will);
  query();
  REQUIRE(bench.posted.run_until([&] { return reported.size() == 3; }));
  std::optional<Error> refused;
  bench.manager->preview("R-000009", Recovery::resume, [&](const Result<ResumePreview>& left) {
    if (!left) refused = left.error();
  });
  REQUIRE(refused);
  CHECK(refused->code == Errc::not_found);
}

TEST_CASE("resuming a run of a safe rig does not acknowledge a rig that is unknown later") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  const std::string first = bench.manager->loaded().front().stored.id();
  REQUIRE(bench.manager->reset("looked at it", "test"));
  bench.posted.throw_once();  // the second run ends with an unknown state of the rig
  const std::string second = bench.submit().stored.id();
  REQUIRE(bench.recover(first, "test"));
  CHECK(bench.ended(second).stored.rig_fact == "unknown");
  CHECK(bench.manager->get(first)->machine.state == RunState::queued);
  REQUIRE(bench.manager->reset("looked at it", "test"));
  REQUIRE(bench.manager->resume_queue("test"));
  CHECK(bench.ended(first).stored.outcome == "complete");
}

TEST_CASE("the request to resume a run does not outlive the daemon if the rig is unknown") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  std::string id;
  {
    RunManagerBench bench(folder);
    id = bench.manager->loaded().front().stored.id();
    bench.manager->halt(RigState::Stop::halt, "test");  // keeps it in the queue
    REQUIRE(bench.recover(id, "test"));
    REQUIRE(bench.store.commit({.rig = RigState{RigFact::unknown, id}}));
  }
  RunManagerBench bench(folder);
  const std::string other = bench.submit().stored.id();
  CHECK(bench.manager->get(id)->machine.state == RunState::queued);
  CHECK(bench.manager->get(other)->machine.state == RunState::queued);
  REQUIRE(bench.manager->reset("looked at it", "test"));
  REQUIRE(bench.manager->resume_queue("test"));
  CHECK(bench.ended(id).stored.outcome == "complete");
  CHECK(bench.ended(other).stored.outcome == "complete");
}

}  // namespace run_manager_recovery_test
