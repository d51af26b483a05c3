// The line of runs that wait for the rig: its order, its revision, and that both outlive the
// daemon. SIMULATED.

#include <catch2/catch.hpp>
#include <random>

#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace queue_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::leave_interrupted;
using test::RunManagerBench;
using test::TemporaryFolder;

namespace {

using Numbers = std::vector<std::int64_t>;

/// Three runs in a line that is held.
void fill(RunManagerBench& bench) {
  REQUIRE(bench.manager->pause_queue("ada"));
  for (int i = 0; i < 3; ++i) bench.submit();
}

Numbers begun_in_order(RunStore& store) {
  Numbers out;
  const auto lines = store.tail("", 10'000);
  for (const auto& line : *lines)
    if (line.kind == "state" && line.payload_json.find("arming") != std::string::npos)
      out.push_back(std::stoll(line.run.substr(2)));
  return out;
}

}  // namespace

TEST_CASE("A line puts a run where it belongs, whatever the place") {
  RunQueue queue;
  for (const std::int64_t run : {1, 2, 3}) queue.put(run, 99);
  CHECK(queue.runs() == Numbers{1, 2, 3});
  queue.put(3, 0);
  CHECK(queue.runs() == Numbers{3, 1, 2});
  queue.put(3, 1);
  CHECK(queue.runs() == Numbers{1, 3, 2});
  queue.put(1, 99);
  CHECK(queue.runs() == Numbers{3, 2, 1});
  CHECK(queue.find_place(2) == 1);
  CHECK(queue.find_place(9) == 3);
}

TEST_CASE("runs begin in the order of their line, and each change is another revision") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  const std::int64_t before = bench.manager->queue().revision();
  fill(bench);
  CHECK(bench.manager->queue().revision() == before + 4);
  CHECK(bench.manager->queue().runs() == Numbers{1, 2, 3});
  REQUIRE(bench.manager->move("R-000003", 0, "ada"));
  CHECK(bench.manager->queue().runs() == Numbers{3, 1, 2});
  CHECK(bench.manager->queue().revision() == before + 5);
  CHECK(bench.manager->move("R-000009", 0, "ada").error().code == Errc::not_found);
  CHECK(bench.manager->pause_queue("ada").error().code == Errc::wrong_state);
  CHECK_FALSE(bench.manager->active());
  const RunRequest next{bench.request.recipe, {}, {}, "test", 0};
  REQUIRE(bench.submit(next));
  CHECK(bench.manager->queue().runs() == Numbers{4, 3, 1, 2});
  REQUIRE(bench.manager->remove("R-000001", "ada"));
  CHECK(bench.manager->queue().runs() == Numbers{4, 3, 2});
  REQUIRE(bench.manager->resume_queue("ada"));
  CHECK(bench.manager->queue().runs() == Numbers{3, 2});
  CHECK(bench.manager->move("R-000004", 0, "ada").error().code == Errc::wrong_state);
  CHECK(bench.manager->resume_queue("ada").error().code == Errc::wrong_state);
  for (const char* id : {"R-000004", "R-000003", "R-000002"})
    CHECK(bench.ended(id).stored.outcome == "complete");
  CHECK(begun_in_order(bench.store) == Numbers{4, 3, 2});
  CHECK(bench.manager->queue().runs().empty());
}

TEST_CASE("a paused line lets the run under way end, and nothing begin") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  const std::string first = bench.submit().stored.id();
  const std::string second = bench.submit().stored.id();
  REQUIRE(bench.manager->pause_queue("ada"));
  CHECK(bench.ended(first).stored.outcome == "complete");
  bench.manager->tick();
  CHECK(bench.manager->get(second)->machine.state == RunState::queued);
  REQUIRE(bench.manager->resume_queue("ada"));
  CHECK(bench.ended(second).stored.outcome == "complete");
}

TEST_CASE("the line outlives the daemon, which begins nothing of it before somebody's word") {
  const TemporaryFolder folder;
  std::int64_t revision = 0;
  {
    RunManagerBench bench(folder);
    fill(bench);
    REQUIRE(bench.manager->move("R-000003", 0, "ada"));
    revision = bench.manager->queue().revision();
  }
  {
    RunManagerBench bench(folder);
    CHECK(bench.manager->queue().runs() == Numbers{3, 1, 2});
    CHECK(bench.manager->queue().paused_by() == "ada");
    CHECK(bench.manager->queue().revision() > revision);
    for (const char* id : {"R-000001", "R-000002"}) REQUIRE(bench.manager->remove(id, "ada"));
    REQUIRE(bench.manager->resume_queue("ada"));
    bench.ended("R-000003");
    bench.manager->halt(RigState::Stop::halt, "ada");
    bench.submit();  // R-000004 waits on a latched rig
  }
  RunManagerBench bench(folder);
  CHECK(bench.manager->queue().paused_by() == "auto:restart");
  CHECK(bench.manager->queue().runs() == Numbers{4});
  bench.manager->tick();
  CHECK_FALSE(bench.manager->active());
  REQUIRE(bench.manager->reset("looked at it", "ada"));  // which is such a word
  CHECK_FALSE(bench.manager->queue().is_paused());
  CHECK(bench.ended("R-000004").stored.outcome == "complete");
}

TEST_CASE("a run that waits for the disk's room over a restart goes on waiting") {
  const TemporaryFolder folder;
  std::string id;
  {
    RunManagerBench bench(folder, test::tiny_recipe(1));
    REQUIRE(bench.manager->pause_queue("test"));
    id = bench.submit().stored.id();
  }
  RunManagerBench bench(folder, test::tiny_recipe(1));
  bench.disk_is_full = true;
  REQUIRE(bench.manager->resume_queue("test"));
  CHECK(bench.manager->get(id)->machine.state == RunState::queued);
  CHECK_FALSE(bench.manager->queue().is_paused());
  CHECK(bench.manager->status().bytes_awaited > 0);
  bench.disk_is_full = false;
  bench.manager->tick();
  CHECK(bench.ended(id).stored.outcome == "complete");
}

TEST_CASE("an empty line is not held by a restart, and one that somebody paused stays so") {
  const TemporaryFolder folder;
  { RunManagerBench bench(folder); }
  {
    RunManagerBench bench(folder);
    CHECK_FALSE(bench.manager->queue().is_paused());
    REQUIRE(bench.manager->pause_queue("ada"));
  }
  RunManagerBench bench(folder);
  CHECK(bench.manager->queue().paused_by() == "ada");
}

TEST_CASE("a run that somebody goes on with is the next in line") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  fill(bench);
  REQUIRE(bench.recover("R-000001", "ada"));
  CHECK(bench.manager->queue().runs().front() == 1);
  REQUIRE(bench.manager->resume_queue("ada"));
  CHECK(bench.ended("R-000001").stored.outcome == "complete");
}

TEST_CASE("any sequence of changes leaves a line of exactly the runs that wait, kept as it is") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  bench.manager->halt(RigState::Stop::halt, "test");  // nothing begins
  std::mt19937 random(22);
  std::int64_t revision = bench.manager->queue().revision();
  for (int i = 0; i < 300; ++i) {
    const std::string id = "R-00000" + std::to_string(1 + random() % 9);
    switch (random() % 5) {
      case 0:
        if (bench.manager->loaded().size() < 9) bench.submit();
        break;
      case 1:
        static_cast<void>(bench.manager->remove(id, "ada"));
        break;
      case 2:
        static_cast<void>(bench.manager->pause_queue("ada"));
        break;
      case 3:
        static_cast<void>(bench.manager->resume_queue("ada"));
        break;
      default:
        static_cast<void>(bench.manager->move(id, random() % 5, "ada"));
    }
    Numbers waiting;
    for (const RunView& run : bench.manager->loaded())
      if (run.machine.state == RunState::queued) waiting.push_back(run.stored.number);
    Numbers queued = bench.manager->queue().runs();
    REQUIRE(bench.manager->queue() == bench.store.queue().value());
    std::sort(queued.begin(), queued.end());
    REQUIRE(queued == waiting);
    REQUIRE(bench.manager->queue().revision() >= revision);
    revision = bench.manager->queue().revision();
  }
}

}  // namespace queue_test
