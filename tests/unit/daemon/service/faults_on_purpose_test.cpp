// Fault injection on the bench of a run in progress, and e-stops. SIMULATED.

#include <catch2/catch.hpp>

#include "daemon/storage/recorder/campaign_history.hpp"
#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace faults_on_purpose_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::RunManagerBench;
using test::TemporaryFolder;

namespace {

using Reported = std::optional<Status>;

void inject_fault(RunManagerBench& bench, const std::string& fault, bool ends, Reported& reported) {
  bench.manager->inject_fault({fault, ends, "ada", {}},
                              [&reported](const Status& done) { reported = done; });
}

/// A run with a thread that waits at its first message, so that requests come in time.
RunView begun(RunManagerBench& bench) {
  bench.posted.hold();
  return bench.submit();
}

std::size_t fault_lines(const std::filesystem::path& campaign) {
  const auto journal = load_journal(campaign);
  REQUIRE(journal);
  return static_cast<std::size_t>(
      std::count_if(journal->begin(), journal->end(),
                    [](const JournalEntry& line) { return line.kind == fault_kind; }));
}

}  // namespace

TEST_CASE("a fault is injected into the active run, and both journals have it") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  const std::string id = begun(bench).stored.id();
  Reported unknown, silent, cleared;
  inject_fault(bench, R"({"device": "fu", "fault": "silent"})", false, unknown);
  inject_fault(bench, R"({"device": "ft", "fault": "noise", "amount": 0.001})", false, cleared);
  inject_fault(bench, R"({"device": "ft", "fault": "silent"})", false, silent);
  bench.posted.let_go();
  const RunView run = bench.ended(id);
  REQUIRE(bench.posted.run_until([&] { return unknown && silent && cleared; }));
  REQUIRE_FALSE(*unknown);
  CHECK(unknown->error().code == Errc::not_found);
  CHECK(unknown->error().where == "/device");
  CHECK(*silent);
  CHECK(run.stored.outcome != "complete");
  CHECK(run.stored.error.find("ft") != std::string::npos);
  const auto campaign = run.stored.folder / "campaign.sqlite";
  CHECK(fault_lines(campaign) == 2);
  CHECK(load_history(campaign)->disturbed);
  const auto lines = bench.store.tail(id, 1000);
  REQUIRE(lines);
  CHECK(std::count_if(lines->begin(), lines->end(),
                      [](const auto& line) { return line.kind == "fault"; }) == 2);
}

TEST_CASE("a fault that was ended leaves the trials whole") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  const std::string id = begun(bench).stored.id();
  Reported given, ended;
  inject_fault(bench, R"({"device": "ft", "fault": "silent", "start_s": 5})", false, given);
  inject_fault(bench, R"({"device": "ft", "fault": ""})", true, ended);
  bench.posted.let_go();
  const RunView run = bench.ended(id);
  REQUIRE(bench.posted.run_until([&] { return given && ended; }));
  CHECK(*given);
  CHECK(*ended);
  CHECK(run.stored.outcome == "complete");
}

TEST_CASE("without a run a fault is refused, also if the run has just ended") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  Reported reported;
  inject_fault(bench, R"({"device": "ft", "fault": "silent"})", false, reported);
  REQUIRE(reported);
  CHECK(reported->error().code == Errc::wrong_state);
  const std::string id = begun(bench).stored.id();
  REQUIRE(bench.manager->order(id, Order::abort, "ada"));
  Reported late;
  inject_fault(bench, R"({"device": "ft", "fault": "silent"})", false, late);
  bench.posted.let_go();
  bench.ended(id);
  REQUIRE(bench.posted.run_until([&] { return late.has_value(); }));
  Reported after;
  inject_fault(bench, R"({"device": "ft", "fault": "silent"})", false, after);
  REQUIRE(after);
  CHECK(after->error().code == Errc::wrong_state);
}

TEST_CASE("an emergency stop ends a run as a halt does, and outlives halts and the daemon") {
  const TemporaryFolder folder;
  {
    RunManagerBench bench(folder);
    const std::string id = begun(bench).stored.id();
    bench.manager->halt(RigState::Stop::emergency, "ada");
    CHECK(bench.manager->get(id)->machine.state == RunState::halting);
    bench.manager->halt(RigState::Stop::halt, "bo");
    CHECK(bench.manager->rig_state() == RigState{Latch{true, "bo"}});
    bench.posted.let_go();
    CHECK(bench.ended(id).stored.outcome == "aborted");
  }
  RunManagerBench bench(folder);
  CHECK(bench.manager->rig_state().is_emergency());
  REQUIRE(bench.manager->reset("looked at", "ada"));
  CHECK(bench.manager->rig_state() == RigState{});
  bench.manager->halt(RigState::Stop::halt, "bo");
  CHECK_FALSE(bench.manager->rig_state().is_emergency());
}

}  // namespace faults_on_purpose_test
