// The desk of weftd goes on with runs that were interrupted. SIMULATED.

#include "tests/unit/daemon/service/desk_bench.hpp"

namespace desk_recovery_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::control;
using test::DeskBench;
using test::leave_interrupted;
using test::TemporaryFolder;

TEST_CASE("a run whose recovery came to nothing may be recovered again") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  DeskBench bench(folder);
  const std::string id = bench.desk->all().front().stored.id();
  REQUIRE(bench.ended(id).machine.state == RunState::interrupted);
  const std::string recipe = test::read_file(bench.request.recipe);
  test::write_file(bench.request.recipe, recipe + " ");
  REQUIRE(bench.desk->recover(id, "test"));
  const RunView refused = bench.ended(id);
  CHECK(refused.machine.state == RunState::interrupted);
  CHECK(refused.stored.error.find("another recipe") != std::string::npos);
  test::write_file(bench.request.recipe, recipe);
  bench.posted.hold();
  REQUIRE(bench.desk->recover(id, "test"));
  REQUIRE(bench.desk->order(id, Order::abort, "test"));
  bench.posted.let_go();
  const RunView aborted = bench.ended(id);
  CHECK(aborted.machine.state == RunState::interrupted);
  CHECK(aborted.stored.outcome == "aborted");
  REQUIRE(bench.desk->recover(id, "test"));
  const RunView done = bench.ended(id);
  CHECK(done.machine.state == RunState::ended);
  CHECK(done.stored.outcome == "complete");
  CHECK(done.trials_done == 4);
  CHECK_FALSE(bench.desk->recover(id, "test"));
}

TEST_CASE("a daemon that is told to end has a run's end on record, and may go on with it") {
  const TemporaryFolder folder;
  {
    DeskBench bench(folder, test::tiny_recipe(4));
    bench.at_line = [&](const TrialProgress& line, RunOrders&) {
      if (line.done == 2) bench.posted.post([&] { bench.desk->close(); });
    };
    const std::string first = bench.submit().stored.id(), second = bench.submit().stored.id();
    const RunView cut = bench.ended(first);
    CHECK(cut.machine.state == RunState::interrupted);
    CHECK(cut.stored.outcome == "aborted");
    CHECK(cut.stored.cleanup == "done");
    CHECK_FALSE(bench.desk->active());
    CHECK(bench.desk->get(second)->machine.state == RunState::queued);
  }
  DeskBench bench(folder, test::tiny_recipe(4));
  CHECK(bench.desk->standing().fact == RigStanding::Fact::safe);
  const std::string id = bench.desk->all().front().stored.id();
  CHECK(bench.desk->get(id)->stored.outcome == "aborted");
  REQUIRE(bench.desk->recover(id, "test"));
  REQUIRE(bench.desk->start_line("test"));
  CHECK(bench.ended(id).stored.outcome == "complete");
}

TEST_CASE("a run whose resume was aborted while the past was played counts what is on record") {
  const TemporaryFolder folder;
  leave_interrupted(folder, 4, 3);
  DeskBench bench(folder, test::tiny_recipe(4));
  const std::string id = bench.desk->all().front().stored.id();
  const std::size_t on_record = bench.desk->get(id).value().trials_done;
  REQUIRE(on_record > 2);
  bench.at_line = [](const TrialProgress&, RunOrders& orders) {
    orders.give({Order::abort, "test"});
  };
  REQUIRE(bench.desk->recover(id, "test"));
  const RunView aborted = bench.ended(id);
  CHECK(aborted.machine.state == RunState::interrupted);
  CHECK(aborted.stored.dataset_error.find("Nothing was changed: resume it again") !=
        std::string::npos);
  CHECK(aborted.stored.rig_fact == "safe");
  CHECK(aborted.trials_done == on_record);
  bench.at_line = {};
  REQUIRE(bench.desk->recover(id, "test"));
  CHECK(bench.ended(id).trials_done == 8);
}

TEST_CASE("a run that is withdrawn before it goes on is as interrupted as it was") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  DeskBench bench(folder);
  const std::string id = bench.desk->all().front().stored.id();
  bench.desk->halt("test");  // nothing begins on a latched rig
  REQUIRE(bench.desk->recover(id, "test"));
  REQUIRE(bench.desk->withdraw(id, "test"));
  CHECK(bench.desk->get(id).value().stored.outcome == "interrupted");
  REQUIRE(bench.desk->recover(id, "test"));
  CHECK(bench.desk->get(id).value().machine.state == RunState::queued);
}

TEST_CASE("the desk goes on with its work while a campaign is looked at, and tells all who asked") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  DeskBench bench(folder);
  const std::string id = bench.desk->all().front().stored.id();
  std::vector<ResumePreview> told;
  const auto ask = [&] {
    bench.desk->preview(id, Recovery::resume, [&](const Result<ResumePreview>& left) {
      REQUIRE(left);
      told.push_back(*left);
    });
  };
  bench.posted.hold();
  ask();
  ask();
  CHECK(told.empty());  // the look takes as long as the test holds it
  bench.desk->halt("test");
  bench.desk->tick();
  CHECK(bench.desk->standing().fact == RigStanding::Fact::latched);
  bench.posted.let_go();
  REQUIRE(bench.posted.run_until([&] { return told.size() == 2; }));
  CHECK(told[0].planned == 4);
  CHECK(told[0].complete >= 2);
  CHECK(told[1].will == told[0].will);
  ask();
  REQUIRE(bench.posted.run_until([&] { return told.size() == 3; }));
  std::optional<Error> refused;
  bench.desk->preview("R-000009", Recovery::resume, [&](const Result<ResumePreview>& left) {
    if (!left) refused = left.error();
  });
  REQUIRE(refused);
  CHECK(refused->code == Errc::not_found);
}

TEST_CASE("who goes on with a run of a safe rig has said nothing of one that is unknown later") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  DeskBench bench(folder);
  const std::string first = bench.desk->all().front().stored.id();
  REQUIRE(bench.desk->reset("looked at it", "test"));
  bench.posted.throw_once();  // the second run ends without knowing where it left the rig
  const std::string second = bench.submit().stored.id();
  REQUIRE(bench.desk->recover(first, "test"));
  CHECK(bench.ended(second).stored.rig_fact == "unknown");
  CHECK(bench.desk->get(first)->machine.state == RunState::queued);
  REQUIRE(bench.desk->reset("looked at it", "test"));
  CHECK(bench.ended(first).stored.outcome == "complete");
}

TEST_CASE("the wish to go on with a run does not outlive the daemon where the rig is unknown") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  std::string id;
  {
    DeskBench bench(folder);
    id = bench.desk->all().front().stored.id();
    bench.desk->halt("test");  // keeps it in line
    REQUIRE(bench.desk->recover(id, "test"));
    REQUIRE(bench.store.keep({RigStanding::Fact::unknown, id}));
  }
  DeskBench bench(folder);
  const std::string other = bench.submit().stored.id();
  CHECK(bench.desk->get(id)->machine.state == RunState::queued);
  CHECK(bench.desk->get(other)->machine.state == RunState::queued);
  REQUIRE(bench.desk->reset("looked at it", "test"));
  CHECK(bench.ended(id).stored.outcome == "complete");
  CHECK(bench.ended(other).stored.outcome == "complete");
}

}  // namespace desk_recovery_test
