// The queue as a value: what each change makes of it, and which run is next.

#include "daemon/service/run_model/run_queue.hpp"

#include <catch2/catch.hpp>

namespace run_queue_test {

using namespace weft;
using namespace weft::daemon::runs;
using Fact = RigState::Fact;
using Runs = std::vector<RunQueue::Run>;

TEST_CASE("each change of a queue makes another revision; what changes nothing does not") {
  struct Row {
    const char* name;
    bool (*change)(RunQueue&);
    bool is_change;
    Runs runs;
    std::string paused_by;
  };
  const Row rows[] = {
      {"add", [](RunQueue& q) { return q.put(4, 1), true; }, true, {1, 4, 2, 3}, ""},
      {"add past the end", [](RunQueue& q) { return q.put(4, 9), true; }, true, {1, 2, 3, 4}, ""},
      {"move", [](RunQueue& q) { return q.put(3, 0), true; }, true, {3, 1, 2}, ""},
      {"remove", [](RunQueue& q) { return q.remove(2); }, true, {1, 3}, ""},
      {"remove a stranger", [](RunQueue& q) { return q.remove(9); }, false, {1, 2, 3}, ""},
      {"pause", [](RunQueue& q) { return q.pause("ada").has_value(); }, true, {1, 2, 3}, "ada"},
      {"resume", [](RunQueue& q) { return q.resume().has_value(); }, false, {1, 2, 3}, ""},
      {"no bench", [](RunQueue& q) { return q.on_cannot_begin(); }, true, {1, 2, 3}, "auto:failed"},
      {"restart",
       [](RunQueue& q) {
         return q.on_restart({1, 2, 3}), true;
       },
       true,
       {1, 2, 3},
       "auto:restart"},
  };
  for (const Row& row : rows) {
    INFO(row.name);
    RunQueue queue(7, "", {1, 2, 3});
    CHECK(row.change(queue) == row.is_change);
    CHECK(queue.runs() == row.runs);
    CHECK(queue.paused_by() == row.paused_by);
    CHECK(queue.revision() == (row.is_change ? 8 : 7));
  }
}

TEST_CASE("a paused queue is paused by the first who did, and lets nothing begin") {
  RunQueue queue(0, "", {1});
  REQUIRE(queue.pause("ada"));
  CHECK(queue.pause("bo").error().got == "ada");
  CHECK_FALSE(queue.on_cannot_begin());
  CHECK(queue.paused_by() == "ada");
  CHECK_FALSE(queue.next(RigState()));
  CHECK(queue.first_allowed(RigState()) == 1);
  REQUIRE(queue.resume());
  CHECK(queue.next(RigState()) == 1);
}

TEST_CASE("an empty queue is not paused for a bench that does not come up") {
  RunQueue queue;
  CHECK_FALSE(queue.on_cannot_begin());
  CHECK(queue == RunQueue());
}

TEST_CASE("what a daemon finds of a queue when it starts") {
  struct Row {
    const char* name;
    RunQueue saved;
    Runs waiting, runs;
    std::string paused_by;
  };
  const Row rows[] = {
      {"as it was kept", RunQueue(3, "", {3, 1, 2}), {1, 2, 3}, {3, 1, 2}, "auto:restart"},
      {"paused by a person", RunQueue(3, "ada", {2, 1}), {1, 2}, {2, 1}, "ada"},
      {"one is over", RunQueue(3, "", {1, 2}), {2}, {2}, "auto:restart"},
      {"older than the queue", RunQueue(), {1, 2}, {1, 2}, "auto:restart"},
      {"some of them", RunQueue(3, "", {4}), {1, 4, 5}, {4, 1, 5}, "auto:restart"},
      {"empty", RunQueue(3, "auto:restart", {1}), {}, {}, ""},
      {"empty, paused by a person", RunQueue(3, "ada", {}), {}, {}, "ada"},
  };
  for (const Row& row : rows) {
    INFO(row.name);
    RunQueue queue = row.saved;
    queue.on_restart(row.waiting);
    CHECK(queue.runs() == row.runs);
    CHECK(queue.paused_by() == row.paused_by);
    CHECK(queue.revision() == row.saved.revision() + 1);
  }
}

TEST_CASE("the next run is the first that the rig allows") {
  const RunQueue queue(0, "", {1, 2, 3});
  RigState resumed(Fact::unknown, "R-000002");
  resumed.allow_resumed(2);
  struct Row {
    RigState rig;
    std::optional<RunQueue::Run> next;
  };
  const Row rows[] = {{RigState(), 1},
                      {RigState(Fact::unknown, "R-000002"), {}},
                      {resumed, 2},
                      {RigState(Fact::latched, "ada"), {}}};
  for (const auto& [rig, next] : rows) {
    CHECK(queue.next(rig) == next);
    CHECK(queue.first_allowed(rig) == next);
  }
  CHECK_FALSE(RunQueue().next(RigState()));
}

}  // namespace run_queue_test
