// The queue as a value: the effect of each change, and the next run.

#include "daemon/service/run_model/run_queue.hpp"

#include <catch2/catch.hpp>

namespace run_queue_test {

using namespace weft;
using namespace weft::daemon::runs;
using Runs = std::vector<RunQueue::Run>;

namespace {

bool all_ready(RunQueue::Run) {
  return true;
}

}  // namespace

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
      {"automatic pause",
       [](RunQueue& q) { return q.pause_automatically(after_failure); },
       true,
       {1, 2, 3},
       "auto:failed"},
      {"no cause", [](RunQueue& q) { return q.pause_automatically(""); }, false, {1, 2, 3}, ""},
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
  CHECK_FALSE(queue.pause_automatically(after_abort));
  CHECK(queue.paused_by() == "ada");
  CHECK_FALSE(queue.next(RigState(), all_ready));
  CHECK(queue.first_allowed(RigState(), all_ready) == 1);
  REQUIRE(queue.resume());
  CHECK(queue.next(RigState(), all_ready) == 1);
}

TEST_CASE("an automatic pause is for a queue in which runs wait; a person's stays without any") {
  RunQueue queue;
  CHECK_FALSE(queue.pause_automatically(after_failure));
  CHECK(queue == RunQueue());
  for (const char* by : {after_abort, "ada"}) {
    RunQueue one(0, by, {1});
    CHECK(one.remove(1));
    CHECK(one.paused_by() == (by == after_abort ? "" : by));
  }
}

TEST_CASE("the queue goes on after a complete run, and where keep_going covers the end") {
  struct Row {
    EndedRun run;
    std::string_view cause;
  };
  constexpr bool keep = true, rig = true, full = true, cut = true;
  const Row rows[] = {
      {{"complete"}, ""},
      {{"complete", keep, rig}, ""},
      {{"complete", keep, rig, !full, cut}, "auto:interrupted"},  // its record is not concluded
      {{"complete", keep, rig, full, cut}, "auto:disk"},
      {{"stopped", !keep, rig}, "auto:stopped"},
      {{"stopped", keep, rig}, ""},
      {{"aborted", !keep, rig}, "auto:aborted"},
      {{"aborted", keep, rig}, ""},
      {{"aborted", keep, !rig}, "auto:aborted"},
      {{"failed", !keep, rig}, "auto:failed"},
      {{"failed", keep, rig}, ""},
      {{"failed", keep, !rig},
       "auto:failed"},  // the bench did not start, and would not for other runs
      {{"failed", keep, rig, full}, "auto:disk"},
      {{"interrupted", !keep, rig, !full, cut}, "auto:interrupted"},
      {{"interrupted", keep, rig, !full, cut}, "auto:interrupted"},
      {{"complete", !keep, rig, !full, !cut, RunState::running}, ""},
      {{"complete", !keep, rig, !full, !cut, RunState::finishing}, "auto:stopped"},
      {{"complete", !keep, rig, !full, !cut, RunState::aborting}, "auto:aborted"},
      {{"complete", !keep, rig, !full, !cut, RunState::halting}, "auto:halted"},
      {{"complete", keep, rig, !full, !cut, RunState::finishing}, ""},
      {{"complete", keep, rig, !full, !cut, RunState::ended, true}, "auto:failed"},
  };
  for (const auto& [run, cause] : rows) {
    INFO(run.outcome << " keep_going " << run.keep_going << " rig " << run.acquired_rig);
    CHECK(pause_cause_of(run) == cause);
  }
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
      {"empty after an abort", RunQueue(3, "auto:aborted", {1}), {}, {}, ""},
      {"paused after an abort", RunQueue(3, "auto:aborted", {1}), {1}, {1}, "auto:aborted"},
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
  RigState resumed(RigFact::unknown, "R-000002");
  resumed.allow_resumed(2);
  struct Row {
    RigState rig;
    std::optional<RunQueue::Run> next;
  };
  const Row rows[] = {{RigState(), 1},
                      {RigState(RigFact::unknown, "R-000002"), {}},
                      {resumed, 2},
                      {RigState(RigFacts{.fact = RigFact::holding, .acknowledged = true}), 1},
                      {RigState(Latch{false, "ada"}), {}}};
  for (const auto& [rig, next] : rows) {
    CHECK(queue.next(rig, all_ready) == next);
    CHECK(queue.first_allowed(rig, all_ready) == next);
  }
  CHECK_FALSE(RunQueue().next(RigState(), all_ready));
  CHECK(queue.next(RigState(), [](RunQueue::Run run) { return run != 1; }) == 2);
}

}  // namespace run_queue_test
