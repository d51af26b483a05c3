// The run manager of weftd: runs on their own threads, reports on the manager's. SIMULATED.

#include <fstream>
#include <nlohmann/json.hpp>

#include "classifier/base/line_io.hpp"
#include "classifier/live/staged_model.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace run_manager_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::leave_interrupted;
using test::RunManagerBench;
using test::TemporaryFolder;
using test::tiny_recipe;

TEST_CASE("what escapes from a run's thread is a fault of that run; the next waits for a word") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  bench.posted.throw_once();
  const RunView failed = bench.ended(bench.submit().stored.id());
  CHECK(failed.stored.outcome == "failed");
  CHECK(failed.stored.rig_fact == "unknown");
  CHECK(failed.stored.error.find("scripted") != std::string::npos);
  CHECK(bench.manager->rig_state() == RigState{RigFact::unknown, failed.stored.id()});
  const std::string next = bench.submit().stored.id();
  CHECK(bench.manager->get(next)->machine.state == RunState::queued);
  CHECK_FALSE(bench.manager->reset("", "test"));
  REQUIRE(bench.manager->reset("looked at it", "test"));
  REQUIRE(bench.manager->resume_queue("test"));
  CHECK(bench.ended(next).stored.outcome == "complete");
  CHECK(bench.manager->rig_state().facts().fact == RigFact::safe);
  CHECK_FALSE(bench.manager->reset("looked at it", "test"));
}

TEST_CASE("a rig that was halted is latched for the next daemon too") {
  const TemporaryFolder folder;
  { RunManagerBench(folder).manager->halt(RigState::Stop::halt, "the one at the bench"); }
  RunManagerBench bench(folder);
  CHECK(bench.manager->rig_state() == RigState{Latch{false, "the one at the bench"}});
  const std::string id = bench.submit().stored.id();
  CHECK(bench.manager->get(id)->machine.state == RunState::queued);
  REQUIRE(bench.manager->reset("looked at it", "test"));
  REQUIRE(bench.manager->resume_queue("test"));
  CHECK(bench.ended(id).stored.outcome == "complete");
}

TEST_CASE("a daemon that died under a run leaves a rig that only that run or a word may move") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  const std::string id = bench.manager->loaded().front().stored.id();
  CHECK(bench.manager->rig_state() == RigState{RigFact::unknown, id});
  const std::string other = bench.submit().stored.id();
  CHECK(bench.manager->get(other)->machine.state == RunState::queued);
  REQUIRE(bench.recover(id, "test"));
  CHECK(bench.ended(id).stored.outcome == "complete");
  CHECK(bench.ended(other).stored.outcome == "complete");
  CHECK(bench.manager->rig_state().facts().fact == RigFact::safe);
}

TEST_CASE(
    "a run manager that has forgotten its runs begins a new one beside the old one's folder") {
  const TemporaryFolder folder;
  std::filesystem::path old;
  {
    RunManagerBench bench(folder);
    old = bench.ended(bench.submit().stored.id()).stored.folder;
  }
  const std::string before = test::read_file(old / "campaign.sqlite");
  for (const char* part : {"", "-wal", "-shm"})
    std::filesystem::remove(folder / ("weftd.sqlite" + std::string(part)));
  RunManagerBench bench(folder);
  CHECK(bench.manager->rig_state().facts().fact == RigFact::unknown);  // the earlier run is unknown
  REQUIRE(bench.manager->reset("looked at it", "test"));
  const RunView run = bench.ended(bench.submit().stored.id());
  CHECK(run.stored.id() == "R-000002");  // the number of a folder is never used again
  CHECK(run.stored.outcome == "complete");
  CHECK(run.stored.folder != old);
  CHECK(test::read_file(old / "campaign.sqlite") == before);
}

TEST_CASE("a run that is refused before it has touched the rig leaves it as it was") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  const std::string id = bench.manager->loaded().front().stored.id();
  REQUIRE(bench.manager->reset("looked at it", "test"));
  test::write_file(bench.request.recipe, test::tiny_recipe(3));
  REQUIRE(bench.recover(id, "test"));
  CHECK(bench.ended(id).stored.rig_fact == "unknown");  // as before: only a motion changes it
  CHECK(bench.manager->rig_state() == RigState{RigFacts{RigFact::unknown, id, true}});
}

TEST_CASE("a run stopped before it has the rig does not acquire it") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  bool has_rig = false;
  bench.at_rig = [&] { has_rig = true; };
  const Order order = GENERATE(Order::stop, Order::abort, Order::halt);
  const std::string id = bench.submit().stored.id();  // its thread sends a request, which is
                                                      // answered below
  if (order == Order::halt)
    bench.manager->halt(RigState::Stop::halt, "test");
  else
    REQUIRE(bench.manager->order(id, order, "test"));
  const RunView run = bench.ended(id);
  CHECK_FALSE(has_rig);
  CHECK(run.stored.outcome == (order == Order::stop ? "stopped" : "aborted"));
  CHECK(run.stored.error.find("acquired") != std::string::npos);
  CHECK(run.stored.rig_fact == "safe");
  CHECK((order == Order::halt || bench.manager->rig_state() == RigState{}));
  CHECK_FALSE(bench.manager->queue().is_paused());
}

TEST_CASE("a run from before a restart has the time that its plan takes") {
  const TemporaryFolder folder;
  std::string id;
  {
    RunManagerBench bench(folder);
    bench.manager->halt(RigState::Stop::halt, "test");
    id = bench.submit().stored.id();
  }
  RunManagerBench bench(folder);
  REQUIRE(bench.manager->reset("looked at it", "test"));
  REQUIRE(bench.manager->resume_queue("test"));
  CHECK(bench.manager->get(id)->trials_planned == 4);  // as it was when it was submitted
  CHECK(bench.posted.run_until([&] { return bench.manager->get(id)->trials_planned == 4; }));
  CHECK_FALSE(bench.manager->get(id)->moment);
  CHECK(bench.ended(id).stored.outcome == "complete");
}

TEST_CASE("a disconnected waiter is not notified of an end") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  bench.posted.hold();
  const std::string id = bench.submit().stored.id();
  const auto here = std::make_shared<int>();
  auto gone = std::make_shared<int>();
  int reported = 0;
  bench.manager->when_ended(
      id, [&](const RunView&) { ++reported; }, here);
  bench.manager->when_ended(
      id, [&](const RunView&) { reported += 100; }, gone);
  gone.reset();
  bench.posted.let_go();
  bench.ended(id);
  CHECK(reported == 1);
}

TEST_CASE("a latch is on the disk where only the journal is refused, and its lines follow later") {
  const TemporaryFolder folder;
  {
    RunManagerBench bench(folder);
    REQUIRE(bench.store.database().execute(
        "CREATE TRIGGER full BEFORE INSERT ON journal BEGIN SELECT RAISE(ABORT, 'no room'); END"));
    bench.manager->halt(RigState::Stop::halt, "ada", "smoke");
    CHECK_FALSE(bench.store.is_persisted());
    CHECK(bench.store.rig_state()->is_latched());
    REQUIRE(bench.store.database().execute("DROP TRIGGER full"));
    bench.manager->tick();
    CHECK(bench.store.is_persisted());
    CHECK(bench.store.tail("", 1)->front().kind == "halt");
  }
  CHECK(RunStore::open(folder / "weftd.sqlite").value().rig_state()->is_latched());
}

TEST_CASE("a run is taken into the line by its model's head; the rest is read on its own thread") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  auto recipe = nlohmann::json::parse(test::tiny_recipe(1));
  auto& exploration = recipe["explorations"].begin().value();
  const std::string name = recipe["explorations"].begin().key();
  exploration["live_vote"] = {{"model", "m.live"}};
  test::write_file(bench.request.recipe, recipe.dump());
  const auto head_of = [](const std::string& exploration_name) {
    const std::string head =
        "weft-model 1\nmodality fabric\nstages 1\nmotion_frames 37\nsample_rate_hz 37\n"
        "bench simulated\ndataset_sha256 0\nsoftware 0\ntraining none\ntaxels 16\nphases SPM\n"
        "skew peaks\nnorm l2\nspectrum amplitude\nmode_bin_counts 1\nwindow_s 0\n"
        "window_step_s 0\nsample_period_s 0.02702702702702703\nexploration " +
        exploration_name + "\n";
    return head + classifier::checksum_line("head_crc32 ", head);
  };
  test::write_file(folder / "m.live", head_of("another"));
  const auto refused = bench.submit({bench.request.recipe, {}, {}, "test"});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().got == "another");
  test::write_file(folder / "m.live", head_of(name));
  const RunView failed = bench.ended(bench.submit().stored.id());
  CHECK(failed.stored.outcome == "failed");
  CHECK(failed.stored.error.find("m.live") != std::string::npos);
  CHECK(failed.stored.rig_fact == "safe");  // no device got a command
}

TEST_CASE("a queued run is executed as checked, also if its recipe file has changed") {
  const TemporaryFolder folder;
  const std::string checked = tiny_recipe(1);
  std::string id;
  {
    RunManagerBench bench(folder, checked);
    bench.manager->halt(RigState::Stop::halt, "the one at the bench");
    id = bench.submit().stored.id();
    std::ofstream(bench.request.recipe) << tiny_recipe(3);
  }
  std::filesystem::remove(folder / "recipe.json");
  RunManagerBench bench(folder, tiny_recipe(4));  // the next daemon finds another recipe again
  REQUIRE(bench.manager->reset("looked at it", "test"));
  REQUIRE(bench.manager->resume_queue("test"));
  const RunView run = bench.ended(id);
  CHECK(run.stored.outcome == "complete");
  CHECK(run.trials_done == 2);
  const auto header = load_header(run.stored.folder / campaign_file_name);
  REQUIRE(header);
  CHECK(header->info.recipe_json == checked);
  CHECK(header->info.recipe_sha256 == run.stored.recipe_sha256);
}

TEST_CASE("who names a recipe by its digest gets that recipe or none") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  const std::string meant = "sha256:" + bench.submit().stored.recipe_sha256;
  std::ofstream(bench.request.recipe) << tiny_recipe(1);
  const auto run_request = [&](const std::string& digest) {
    runs::RunRequest out{bench.request.recipe, {}, {}, "test"};
    out.digest = digest;
    return out;
  };
  const auto refused = bench.submit(run_request(meant));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().where == "/params/digest");
  CHECK(bench.manager->loaded().size() == 1);
  CHECK(bench.submit(run_request(refused.error().expected)));
}

TEST_CASE("a stop waits for the longest repetition that may be under way") {
  const TemporaryFolder folder;
  const auto request = test::request_in(
      folder, R"({"schema_version":1,"name":"uneven","source":"test","seed":7,"fabrics":["denim"],
    "repetitions":1,"explorations":{"long":{"kind":"press","phases":[{"phase":"S","duration_s":400},
    {"phase":"P","force_N":5,"force_band_N":0.25,"duration_s":1},{"phase":"E","duration_s":1}]},
    "short":{"kind":"press","phases":[{"phase":"S","duration_s":1},
    {"phase":"P","force_N":5,"force_band_N":0.25,"duration_s":1},{"phase":"E","duration_s":1}]}}})");
  const auto checked = check_quickly(request);
  if (!checked) FAIL(to_string(checked.error()));
  CHECK(summarize(checked->plan, false).limits.trial > std::chrono::seconds(800));
}

TEST_CASE("whatever ends a run, what its recipe does finally has its budget before the ladder") {
  const TemporaryFolder folder;
  std::string recipe = test::short_recipe("denim");
  recipe.insert(1, R"("finally":{"on_stop":[{"do":"wait","duration_s":1500}],"budget_s":1600},)");
  const auto plain = check_quickly(test::request_in(folder, test::short_recipe("denim")));
  const auto checked = check_quickly(test::request_in(folder, recipe));
  if (!checked) FAIL(to_string(checked.error()));
  const Deadlines with = summarize(checked->plan, false).limits,
                  without = summarize(plain->plan, false).limits;
  const std::chrono::seconds budget(1600);
  CHECK(with.running == without.running + budget);
  CHECK(with.finishing == without.finishing + budget);
  CHECK(with.aborting == without.aborting + budget);
  CHECK(with.trial == without.trial);
  CHECK(with.halting == without.halting);
}

TEST_CASE("an abort has no time for what is done only after a success, and time for its retreat") {
  const TemporaryFolder folder;
  const auto limits_of = [&](const std::string& keys) {
    const std::string recipe = keys.empty() ? test::short_recipe("denim") : test::with_keys(keys);
    const auto checked = check_quickly(test::request_in(folder, recipe));
    if (!checked) FAIL(to_string(checked.error()));
    return summarize(checked->plan, false).limits;
  };
  const Deadlines plain = limits_of("");
  const Deadlines success =
      limits_of(R"("finally":{"on_success":[{"do":"wait","duration_s":100}],"budget_s":3600})");
  CHECK(success.aborting == plain.aborting);
  CHECK(success.running == plain.running + std::chrono::hours(1));
  CHECK(success.finishing == plain.finishing + std::chrono::hours(1));  // it may be complete
  const Deadlines fault =
      limits_of(R"("finally":{"on_fault":[{"do":"wait","duration_s":100}],"budget_s":3600})");
  CHECK(fault.aborting == plain.aborting + std::chrono::hours(1));
  constexpr double clearance_mm = 8, slow_mm_s = 0.05;
  const Deadlines slow =
      limits_of(R"("approach":{"transfer_speed_mm_s":)" + std::to_string(slow_mm_s) + "}");
  CHECK(std::chrono::duration<double>(slow.aborting).count() > clearance_mm / slow_mm_s);
}

}  // namespace run_manager_test
