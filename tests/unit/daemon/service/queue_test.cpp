// The line of runs that wait for the rig: its order, its revision, and that both outlive the
// daemon. SIMULATED.

#include <catch2/catch.hpp>
#include <random>

#include "tests/unit/daemon/service/desk_bench.hpp"

namespace queue_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::control;
using test::DeskBench;
using test::leave_interrupted;
using test::TemporaryFolder;

namespace {

using Numbers = std::vector<std::int64_t>;

/// Three runs in a line that is held.
void fill(DeskBench& bench) {
  REQUIRE(bench.desk->hold_line("ada"));
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
  RunLine line;
  for (const std::int64_t run : {1, 2, 3}) line.put(run, 99);
  CHECK(line.runs == Numbers{1, 2, 3});
  line.put(3, 0);
  CHECK(line.runs == Numbers{3, 1, 2});
  line.put(3, 1);
  CHECK(line.runs == Numbers{1, 3, 2});
  line.put(1, 99);
  CHECK(line.runs == Numbers{3, 2, 1});
  CHECK(line.place_of(2) == 1);
  CHECK(line.place_of(9) == 3);
}

TEST_CASE("runs begin in the order of their line, and each change is another revision") {
  const TemporaryFolder folder;
  DeskBench bench(folder);
  const std::int64_t before = bench.desk->line().revision;
  fill(bench);
  CHECK(bench.desk->line().revision == before + 4);
  CHECK(bench.desk->line().runs == Numbers{1, 2, 3});
  REQUIRE(bench.desk->move("R-000003", 0, "ada"));
  CHECK(bench.desk->line().runs == Numbers{3, 1, 2});
  CHECK(bench.desk->line().revision == before + 5);
  CHECK(bench.desk->move("R-000009", 0, "ada").error().code == Errc::not_found);
  CHECK(bench.desk->hold_line("ada").error().code == Errc::wrong_state);
  CHECK_FALSE(bench.desk->active());
  const RunWish next{bench.request.recipe, {}, {}, "test", 0};
  REQUIRE(bench.desk->submit(next));
  CHECK(bench.desk->line().runs == Numbers{4, 3, 1, 2});
  REQUIRE(bench.desk->withdraw("R-000001", "ada"));
  CHECK(bench.desk->line().runs == Numbers{4, 3, 2});
  REQUIRE(bench.desk->start_line("ada"));
  CHECK(bench.desk->line().runs == Numbers{3, 2});
  CHECK(bench.desk->move("R-000004", 0, "ada").error().code == Errc::wrong_state);
  CHECK(bench.desk->start_line("ada").error().code == Errc::wrong_state);
  for (const char* id : {"R-000004", "R-000003", "R-000002"})
    CHECK(bench.ended(id).stored.outcome == "complete");
  CHECK(begun_in_order(bench.store) == Numbers{4, 3, 2});
  CHECK(bench.desk->line().runs.empty());
}

TEST_CASE("a paused line lets the run under way end, and nothing begin") {
  const TemporaryFolder folder;
  DeskBench bench(folder);
  const std::string first = bench.submit().stored.id();
  const std::string second = bench.submit().stored.id();
  REQUIRE(bench.desk->hold_line("ada"));
  CHECK(bench.ended(first).stored.outcome == "complete");
  bench.desk->tick();
  CHECK(bench.desk->get(second)->machine.state == RunState::queued);
  REQUIRE(bench.desk->start_line("ada"));
  CHECK(bench.ended(second).stored.outcome == "complete");
}

TEST_CASE("the line outlives the daemon, which begins nothing of it before somebody's word") {
  const TemporaryFolder folder;
  std::int64_t revision = 0;
  {
    DeskBench bench(folder);
    fill(bench);
    REQUIRE(bench.desk->move("R-000003", 0, "ada"));
    revision = bench.desk->line().revision;
  }
  {
    DeskBench bench(folder);
    CHECK(bench.desk->line().runs == Numbers{3, 1, 2});
    CHECK(bench.desk->line().held_by == "ada");
    CHECK(bench.desk->line().revision > revision);
    for (const char* id : {"R-000001", "R-000002"}) REQUIRE(bench.desk->withdraw(id, "ada"));
    REQUIRE(bench.desk->start_line("ada"));
    bench.ended("R-000003");
    bench.desk->halt("ada");
    bench.submit();  // R-000004 waits on a latched rig
  }
  DeskBench bench(folder);
  CHECK(bench.desk->line().held_by == "auto:restart");
  CHECK(bench.desk->line().runs == Numbers{4});
  bench.desk->tick();
  CHECK_FALSE(bench.desk->active());
  REQUIRE(bench.desk->reset("looked at it", "ada"));  // which is such a word
  CHECK_FALSE(bench.desk->line().held());
  CHECK(bench.ended("R-000004").stored.outcome == "complete");
}

TEST_CASE("a run that waits for the disk's room over a restart goes on waiting") {
  const TemporaryFolder folder;
  std::string id;
  {
    DeskBench bench(folder, test::tiny_recipe(1));
    REQUIRE(bench.desk->hold_line("test"));
    id = bench.submit().stored.id();
  }
  DeskBench bench(folder, test::tiny_recipe(1));
  bench.disk_is_full = true;
  REQUIRE(bench.desk->start_line("test"));
  CHECK(bench.desk->get(id)->machine.state == RunState::queued);
  CHECK_FALSE(bench.desk->line().held());
  CHECK(bench.desk->bytes_awaited() > 0);
  bench.disk_is_full = false;
  bench.desk->tick();
  CHECK(bench.ended(id).stored.outcome == "complete");
}

TEST_CASE("an empty line is not held by a restart, and one that somebody paused stays so") {
  const TemporaryFolder folder;
  { DeskBench bench(folder); }
  {
    DeskBench bench(folder);
    CHECK_FALSE(bench.desk->line().held());
    REQUIRE(bench.desk->hold_line("ada"));
  }
  DeskBench bench(folder);
  CHECK(bench.desk->line().held_by == "ada");
}

TEST_CASE("a run that somebody goes on with is the next in line") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  DeskBench bench(folder);
  fill(bench);
  REQUIRE(bench.desk->recover("R-000001", "ada"));
  CHECK(bench.desk->line().runs.front() == 1);
  REQUIRE(bench.desk->start_line("ada"));
  CHECK(bench.ended("R-000001").stored.outcome == "complete");
}

TEST_CASE("any sequence of changes leaves a line of exactly the runs that wait, kept as it is") {
  const TemporaryFolder folder;
  DeskBench bench(folder);
  bench.desk->halt("test");  // nothing begins
  std::mt19937 random(22);
  std::int64_t revision = bench.desk->line().revision;
  for (int i = 0; i < 300; ++i) {
    const std::string id = "R-00000" + std::to_string(1 + random() % 9);
    switch (random() % 5) {
      case 0:
        if (bench.desk->all().size() < 9) bench.submit();
        break;
      case 1:
        static_cast<void>(bench.desk->withdraw(id, "ada"));
        break;
      case 2:
        static_cast<void>(bench.desk->hold_line("ada"));
        break;
      case 3:
        static_cast<void>(bench.desk->start_line("ada"));
        break;
      default:
        static_cast<void>(bench.desk->move(id, random() % 5, "ada"));
    }
    Numbers waiting;
    for (const RunView& run : bench.desk->all())
      if (run.machine.state == RunState::queued) waiting.push_back(run.stored.number);
    Numbers lined = bench.desk->line().runs;
    REQUIRE(bench.desk->line() == bench.store.line().value());
    std::sort(lined.begin(), lined.end());
    REQUIRE(lined == waiting);
    REQUIRE(bench.desk->line().revision >= revision);
    revision = bench.desk->line().revision;
  }
}

}  // namespace queue_test
