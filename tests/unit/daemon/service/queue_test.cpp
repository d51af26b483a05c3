// The queue of runs: its order and its revision, which both outlive the daemon. SIMULATED.

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

/// Three runs in a paused queue.
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
  REQUIRE(bench.manager->edit("R-000003", {.place = 0}, "ada"));
  CHECK(bench.manager->queue().runs() == Numbers{3, 1, 2});
  CHECK(bench.manager->queue().revision() == before + 5);
  CHECK(bench.manager->edit("R-000009", {.place = 0}, "ada").error().code == Errc::not_found);
  CHECK(bench.manager->pause_queue("ada").error().code == Errc::wrong_state);
  CHECK_FALSE(bench.manager->active());
  const RunRequest next{bench.request.recipe, {}, {}, "test", 0};
  REQUIRE(bench.submit(next));
  CHECK(bench.manager->queue().runs() == Numbers{4, 3, 1, 2});
  REQUIRE(bench.manager->remove("R-000001", "ada"));
  CHECK(bench.manager->queue().runs() == Numbers{4, 3, 2});
  REQUIRE(bench.manager->resume_queue("ada"));
  CHECK(bench.manager->queue().runs() == Numbers{3, 2});
  CHECK(bench.manager->edit("R-000004", {.place = 0}, "ada").error().code == Errc::wrong_state);
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

TEST_CASE("the queue outlives the daemon and stays paused until a person starts it") {
  const TemporaryFolder folder;
  std::int64_t revision = 0;
  {
    RunManagerBench bench(folder);
    fill(bench);
    REQUIRE(bench.manager->edit("R-000003", {.place = 0}, "ada"));
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
    bench.submit();  // R-000004 waits for a latched rig
  }
  RunManagerBench bench(folder);
  CHECK(bench.manager->queue().paused_by() == "auto:restart");
  CHECK(bench.manager->queue().runs() == Numbers{4});
  bench.manager->tick();
  CHECK_FALSE(bench.manager->active());
  REQUIRE(bench.manager->reset("looked at it", "ada"));  // which starts nothing
  CHECK(bench.manager->queue().paused_by() == "auto:restart");
  CHECK_FALSE(bench.manager->active());
  REQUIRE(bench.manager->resume_queue("ada"));
  CHECK(bench.ended("R-000004").stored.outcome == "complete");
}

TEST_CASE("a full disk pauses the queue, and free space starts nothing") {
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
  CHECK(bench.manager->queue().paused_by() == "auto:disk");
  CHECK(bench.manager->status().bytes_awaited > 0);
  bench.disk_is_full = false;
  bench.manager->tick();
  CHECK_FALSE(bench.manager->active());
  REQUIRE(bench.manager->resume_queue("test"));
  CHECK(bench.ended(id).stored.outcome == "complete");
}

TEST_CASE("the next run waits for a person after every end but complete") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  struct Row {
    std::optional<Order> order;  ///< none: the bench fails
    std::string paused_by;
  };
  const Row rows[] = {
      {Order::stop, "auto:stopped"}, {Order::abort, "auto:aborted"}, {{}, "auto:failed"}};
  const Row& row = rows[GENERATE(0, 1, 2)];
  const bool keep_going = GENERATE(false, true);
  bench.at_line = [&](const TrialProgress& line, RunOrders& orders) {
    if (line.done != 1) return;
    if (!row.order) throw std::runtime_error("the bench breaks");
    orders.give({*row.order, "ada"});
  };
  RunRequest wanted{bench.request.recipe, {}, {}, "ada"};
  wanted.keep_going = keep_going;
  const std::string first = bench.submit(wanted)->stored.id();
  const std::string second = bench.submit().stored.id();
  CHECK(bench.ended(first).stored.outcome == row.paused_by.substr(5));
  bench.at_line = {};
  const bool continues = keep_going && row.order;  // the rig is unknown if the bench failed
  CHECK(bench.manager->queue().paused_by() == (keep_going ? "" : row.paused_by));
  CHECK(bench.manager->active().has_value() == continues);
  if (keep_going) return;
  if (!row.order) REQUIRE(bench.manager->reset("looked at it", "ada"));
  bench.manager->tick();
  CHECK_FALSE(bench.manager->active());
  REQUIRE(bench.manager->resume_queue("ada"));
  CHECK(bench.ended(second).stored.outcome == "complete");
}

TEST_CASE("a halt pauses the queue at once, also with keep_going") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  RunRequest wanted{bench.request.recipe, {}, {}, "ada"};
  wanted.keep_going = true;
  const std::string first = bench.submit(wanted)->stored.id();
  bench.submit();
  REQUIRE(bench.posted.run_until(
      [&] { return bench.manager->get(first)->machine.state == RunState::running; }));
  bench.manager->halt(RigState::Stop::halt, "bo");
  CHECK(bench.manager->queue().paused_by() == "auto:halted");
  bench.ended(first);
  REQUIRE(bench.manager->reset("looked at it", "ada"));
  CHECK(bench.manager->queue().paused_by() == "auto:halted");
  CHECK_FALSE(bench.manager->active());
}

TEST_CASE("a reset pauses a queue in which runs wait") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  bench.manager->halt(RigState::Stop::halt, "bo");
  const std::string id = bench.submit().stored.id();
  CHECK_FALSE(bench.manager->queue().is_paused());
  REQUIRE(bench.manager->reset("looked at it", "ada"));
  CHECK(bench.manager->queue().paused_by() == "auto:reset");
  CHECK_FALSE(bench.manager->active());
  REQUIRE(bench.manager->remove(id, "ada"));
  CHECK_FALSE(bench.manager->queue().is_paused());  // no run waits
}

TEST_CASE("a pause that no repetition is left to take pauses the queue") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder, test::tiny_recipe(1));
  const std::string first = bench.submit().stored.id(), second = bench.submit().stored.id();
  REQUIRE(bench.posted.run_until([&] {
    const RunView run = bench.manager->get(first).value();
    return run.trials_done + 1 == run.trials_planned && run.moment->step == recipes::Step::sliding;
  }));
  const auto paused = bench.manager->order(first, Order::pause, "ada");
  REQUIRE(paused);
  CHECK(paused->pause_is_carried_over);
  CHECK(bench.manager->queue().paused_by() == "ada");
  CHECK(bench.ended(first).stored.outcome == "complete");
  CHECK_FALSE(bench.manager->active());
  REQUIRE(bench.manager->resume_queue("ada"));
  CHECK(bench.ended(second).stored.outcome == "complete");
}

TEST_CASE("an order to hold or end an ended run pauses the queue, and the hint reports it") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder, test::tiny_recipe(1));
  const Order order = GENERATE(Order::pause, Order::pause_now, Order::stop, Order::abort);
  const std::string first = bench.submit().stored.id();
  bench.submit();
  bench.submit();
  bench.ended(first);
  const auto late = bench.manager->order(first, order, "ada");
  REQUIRE_FALSE(late);
  CHECK(late.error().code == Errc::wrong_state);
  CHECK(late.error().hint.find("weft queue start") != std::string::npos);
  CHECK(bench.manager->queue().paused_by() == "ada");
  CHECK_FALSE(bench.manager->order(first, Order::resume, "ada"));
}

TEST_CASE("a restart does not pause an empty queue, and a queue paused by a person stays so") {
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

TEST_CASE("a resumed run is the next in the queue") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  fill(bench);
  REQUIRE(bench.recover("R-000001", "ada"));
  CHECK(bench.manager->queue().runs().front() == 1);
  REQUIRE(bench.manager->resume_queue("ada"));
  CHECK(bench.ended("R-000001").stored.outcome == "complete");
}

TEST_CASE("copies have numbers and seeds of their own, in one line") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder, test::tiny_recipe(1));
  REQUIRE(bench.manager->pause_queue("ada"));
  bench.submit();
  RunRequest wanted{bench.request.recipe, 7, "three", "ada", 0};
  wanted.copies = 3;
  CHECK(bench.submit(wanted)->stored.number == 2);
  CHECK(bench.manager->queue().runs() == Numbers{2, 3, 4, 1});
  for (const std::int64_t number : {2, 3, 4}) {
    const StoredRun run = bench.manager->get(run_id(number))->stored;
    CHECK(run.seed == 7 + static_cast<std::uint64_t>(number) - 2);
    CHECK(run.folder.filename() == run_id(number) + "-three");
  }
  wanted.copies = most_copies + 1;
  CHECK(bench.submit(wanted).error().code == Errc::range);
  REQUIRE(bench.manager->clear_queue("ada"));
  CHECK(bench.manager->queue().runs().empty());
  for (const RunView& run : bench.manager->loaded()) CHECK(run.stored.outcome == "stopped");
}

TEST_CASE("a run begins once the one that it follows has ended complete, and others may pass it") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder, test::tiny_recipe(1));
  const bool is_aborted = GENERATE(true, false);
  REQUIRE(bench.manager->pause_queue("ada"));
  const std::string first = bench.submit().stored.id();
  RunRequest wanted{bench.request.recipe, {}, {}, "ada", 0};
  wanted.after = first;
  const std::string follower = bench.submit(wanted)->stored.id();
  CHECK(bench.manager->queue().runs() == Numbers{2, 1});
  CHECK(bench.manager->edit(first, {.after = follower}, "ada").error().code == Errc::wrong_state);
  CHECK(bench.manager->edit(first, {.after = first}, "ada").error().code == Errc::wrong_state);
  CHECK(bench.manager->edit(first, {.after = "R-000009"}, "ada").error().code == Errc::not_found);
  REQUIRE(bench.manager->resume_queue("ada"));
  CHECK(bench.manager->active() == first);
  if (is_aborted) REQUIRE(bench.manager->order(first, Order::abort, "ada"));
  bench.ended(first);
  if (!is_aborted) {
    CHECK(bench.ended(follower).stored.outcome == "complete");
    return;
  }
  REQUIRE(bench.manager->resume_queue("ada"));
  CHECK_FALSE(bench.manager->active());
  CHECK(bench.manager->get(follower)->is_blocked);
  const std::string last = bench.submit().stored.id();
  CHECK(bench.ended(last).stored.outcome == "complete");
  REQUIRE(bench.manager->edit(follower, {.name = "free", .after = ""}, "ada"));
  CHECK(bench.ended(follower).stored.outcome == "complete");
  CHECK(bench.manager->get(follower)->stored.folder.filename() == follower + "-free");
}

TEST_CASE("any sequence of changes leaves a line of exactly the runs that wait, kept as it is") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  bench.manager->halt(RigState::Stop::halt, "test");  // no run starts
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
        static_cast<void>(bench.manager->edit(id, {.place = random() % 5}, "ada"));
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
