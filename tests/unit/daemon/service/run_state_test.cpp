// The states of a run: the orders that each accepts, and its deadline.

#include <catch2/catch.hpp>
#include <map>
#include <random>

#include "daemon/service/run_model/run_state.hpp"

namespace run_state_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using namespace std::chrono_literals;
using recipes::Step;

namespace {

const Deadlines limits = Deadlines::of(1000, 50);

RunStateMachine in(RunState state) {
  return {state, state == RunState::queued || state >= RunState::ended
                     ? RunStateMachine::Clock::max()
                     : RunStateMachine::Clock(1h)};
}

constexpr auto& states = all_run_states;
constexpr std::array orders{Order::pause, Order::pause_now, Order::resume, Order::confirm,
                            Order::stop,  Order::abort,     Order::halt};

/// One letter for each state that an order leads to; "-": refused.
std::string row(RunState state) {
  std::string out;
  for (const Order order : orders) {
    const auto step = on_order(in(state), limits, order, 0s);
    out += step ? std::string(to_string(step->next.state)).substr(0, 1) : "-";
    if (step) CHECK(step->order == order);
  }
  return out;
}

}  // namespace

TEST_CASE("Every order in every state follows the table, or is refused") {
  // pause, pause now, resume, confirm, stop, abort, halt
  const std::map<RunState, std::string> table{
      {RunState::queued, "-------"},   {RunState::arming, "----fah"},
      {RunState::running, "pp--fah"},  {RunState::pausing, "ppr-fah"},
      {RunState::held, "--r-fah"},     {RunState::awaiting_operator, "pp-rfah"},
      {RunState::resuming, "----fah"}, {RunState::finishing, "-----ah"},
      {RunState::aborting, "------h"}, {RunState::halting, "-------"},
      {RunState::ended, "-------"},    {RunState::interrupted, "-------"}};
  for (const RunState state : states) {
    INFO(to_string(state));
    CHECK(row(state) == table.at(state));
  }
}

TEST_CASE("A refused order lists the orders that the state accepts") {
  const auto refused = on_order(in(RunState::finishing), limits, Order::pause, 0s);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::wrong_state);
  CHECK(refused.error().expected == "abort, halt");
}

TEST_CASE("A run that no one ends climbs the ladder to its end by its deadlines") {
  for (const RunState from : states) {
    if (from == RunState::queued || from >= RunState::ended) continue;
    RunStateMachine run = in(from);
    RunStateMachine::Clock now = 0s;
    std::vector<Order> given;
    bool lost = false;
    for (int i = 0; run.state != RunState::ended; ++i) {
      REQUIRE(i < 8);
      REQUIRE(run.deadline < RunStateMachine::Clock::max());
      now = run.deadline;
      const RunStep step = on_time(run, limits, now);
      REQUIRE(step.next.state != run.state);
      if (step.order) given.push_back(*step.order);
      lost = step.lost;
      run = step.next;
    }
    INFO(to_string(from));
    CHECK(std::is_sorted(given.begin(), given.end()));
    CHECK(lost);  // no answer came: the rig is unknown
  }
}

TEST_CASE("A paused run is held until a person resumes it") {
  RunStateMachine run = on_begun({}, limits, 0s).next;
  CHECK(run.state == RunState::arming);
  run = on_step(run, limits, Step::clearing, 1s).next;
  CHECK(run.state == RunState::running);
  run = on_order(run, limits, Order::pause, 2s)->next;
  run = on_step(run, limits, Step::retracting, 3s).next;
  CHECK(run.state == RunState::pausing);
  run = on_step(run, limits, Step::held, 4s).next;
  CHECK(run.state == RunState::held);
  CHECK(run.deadline == 4s + 24h);
  run = on_order(run, limits, Order::resume, 5s)->next;
  run = on_step(run, limits, Step::clearing, 6s).next;
  CHECK(run.state == RunState::running);
}

TEST_CASE("An operator step is awaited and confirmed, then the run continues") {
  RunStateMachine run = on_begun({}, limits, 0s).next;
  run = on_step(run, limits, Step::awaiting_operator, 1s).next;
  CHECK(run.state == RunState::awaiting_operator);
  CHECK(run.deadline == 1s + 24h);
  run = on_order(run, limits, Order::confirm, 2s)->next;
  CHECK(run.state == RunState::resuming);
  run = on_step(run, limits, Step::awaiting_operator, 3s).next;  // there is a second step
  CHECK(run.state == RunState::awaiting_operator);
  CHECK(run.deadline == 3s + 24h);
  run = on_order(run, limits, Order::confirm, 4s)->next;
  run = on_step(run, limits, Step::clearing, 5s).next;
  CHECK(run.state == RunState::running);
  run = on_step(run, limits, Step::awaiting_operator, 6s).next;
  run = on_order(run, limits, Order::pause, 7s)->next;
  run = on_step(run, limits, Step::held, 8s).next;
  CHECK(run.state == RunState::held);
  run = on_order(run, limits, Order::resume, 9s)->next;
  run = on_step(run, limits, Step::awaiting_operator, 10s).next;
  CHECK(run.state == RunState::awaiting_operator);
  const auto at_deadline = on_time(run, limits, run.deadline);
  CHECK(at_deadline.next.state == RunState::finishing);
  CHECK(at_deadline.order == Order::stop);
}

TEST_CASE(
    "Any of 100 000 sequences of orders, reports and time ends once the run's thread is silent") {
  constexpr std::array steps{Step::held, Step::awaiting_operator, Step::clearing, Step::sliding,
                             Step::retracting};
  std::mt19937 random(20261122);
  for (int round = 0; round < 100'000; ++round) {
    RunStateMachine run;
    RunStateMachine::Clock now = 0s;
    for (int i = 0; i < 30; ++i) {
      now += std::chrono::seconds(random() % 400);
      switch (random() % 4) {
        case 0:
          if (const auto step = on_order(run, limits, orders[random() % orders.size()], now))
            run = step->next;
          break;
        case 1:
          run = on_step(run, limits, steps[random() % steps.size()], now).next;
          break;
        case 2:
          run = on_begun(run, limits, now).next;
          break;
        default:
          run = on_time(run, limits, now).next;
      }
      const bool waits_for_people = run.state == RunState::queued || run.state == RunState::ended;
      if ((run.deadline == RunStateMachine::Clock::max()) != waits_for_people)
        FAIL("a state that waits for no one has its deadline");
    }
    for (int i = 0; run.state != RunState::queued && run.state != RunState::ended; ++i) {
      if (i == 8) FAIL("no answer, and it does not end");
      now = std::max(now, run.deadline);
      run = on_time(run, limits, now).next;
    }
  }
}

TEST_CASE("A plan of centuries has its deadlines ahead") {
  const Deadlines centuries = Deadlines::of(1e11, 1e11);
  CHECK(centuries.running > Deadlines::of(1e9, 1).running);
  CHECK(centuries.trial > Deadlines::of(1, 1e9).trial);
}

TEST_CASE("The facts of a run's end by how its thread came to it, and by how it had ended before") {
  const RunFacts none,
      stopped{.outcome = "stopped",
              .cleanup = "done",
              .rig_fact = "safe",
              .dataset_error = "no room",
              .bench_outcome = "stopped"},
      killed{.outcome = "interrupted", .cleanup = "skipped", .rig_fact = "unknown"};
  const RunFacts whole{
      .outcome = "complete", .cleanup = "done", .rig_fact = "safe", .dataset_sha256 = "36426411"};
  const auto found = [](const char* outcome, const char* cleanup, const char* rig,
                        const char* error) {
    return RunFacts{.outcome = outcome, .cleanup = cleanup, .rig_fact = rig, .error = error};
  };
  const RunFacts failed = found("failed", "skipped", "unknown", "no device answers"),
                 aborted = found("aborted", "done", "safe", "");
  struct Row {
    const char* name;
    RunFacts former;
    RunEnd end;
    std::string outcome, cleanup;
    std::string error = {}, dataset_error = {}, bench_outcome = {}, bench_error = {};
  };
  const char* const by_the_end = daemon_stopped_error;
  const Row rows[] = {
      {.name = "it came to its end",
       .former = none,
       .end = {.found = whole, .has_summary = true, .acquired_rig = true},
       .outcome = "complete",
       .cleanup = "done",
       .bench_outcome = "complete"},
      {.name = "it takes the rig again",
       .former = stopped,
       .end = {.found = whole, .has_summary = true, .acquired_rig = true},
       .outcome = "complete",
       .cleanup = "done",
       .bench_outcome = "complete"},
      {.name = "the daemon's end aborts it",
       .former = none,
       .end = {.found = aborted, .has_summary = true, .acquired_rig = true, .was_closing = true},
       .outcome = "aborted",
       .cleanup = "done",
       .error = by_the_end,
       .bench_outcome = "aborted",
       .bench_error = by_the_end},
      {.name = "a person had aborted it",
       .former = none,
       .end = {.found = aborted, .has_summary = true, .acquired_rig = true},
       .outcome = "aborted",
       .cleanup = "done",
       .bench_outcome = "aborted"},
      {.name = "its error is shown first",
       .former = none,
       .end = {.found = found("aborted", "done", "safe", "stalled"),
               .has_summary = true,
               .acquired_rig = true,
               .was_closing = true},
       .outcome = "aborted",
       .cleanup = "done",
       .error = "stalled",
       .bench_outcome = "aborted",
       .bench_error = "stalled"},
      {.name = "the bench did not come up",
       .former = none,
       .end = {.found = failed, .has_summary = false, .acquired_rig = false},
       .outcome = "failed",
       .cleanup = "skipped",
       .error = "no device answers"},
      {.name = "the run had the rig and escaped",
       .former = none,
       .end = {.found = failed, .has_summary = false, .acquired_rig = true},
       .outcome = "failed",
       .cleanup = "skipped",
       .error = "no device answers",
       .bench_outcome = "failed",
       .bench_error = "no device answers"},
      {.name = "it only concludes",
       .former = stopped,
       .end = {.found = whole, .has_summary = true, .acquired_rig = false},
       .outcome = "stopped",
       .cleanup = "done",
       .bench_outcome = "stopped"},
      {.name = "it only concludes, and died on the bench before",
       .former = killed,
       .end = {.found = whole, .has_summary = true, .acquired_rig = false},
       .outcome = "complete",
       .cleanup = "skipped"},
      {.name = "a resume is refused",
       .former = stopped,
       .end = {.found = failed, .has_summary = false, .acquired_rig = false},
       .outcome = "stopped",
       .cleanup = "done",
       .error = "no device answers",
       .dataset_error = "no room",
       .bench_outcome = "stopped"},
      {.name = "an order ends a resume before it has the rig",
       .former = stopped,
       .end = {.found = found("aborted", "skipped", "unknown", "stop ordered"),
               .has_summary = false,
               .acquired_rig = false},
       .outcome = "aborted",
       .cleanup = "done",
       .error = "stop ordered",
       .dataset_error = "no room",
       .bench_outcome = "stopped"},
      {.name = "a resume fails with the rig",
       .former = stopped,
       .end = {.found = failed, .has_summary = false, .acquired_rig = true},
       .outcome = "failed",
       .cleanup = "skipped",
       .error = "no device answers",
       .bench_outcome = "failed",
       .bench_error = "no device answers"},
  };
  for (const Row& row : rows) {
    INFO(row.name);
    const RunFacts facts = facts_of_end(row.former, row.end);
    const RunFacts expected{.outcome = row.outcome,
                            .cleanup = row.cleanup,
                            .rig_fact = row.end.found.rig_fact,
                            .error = row.error,
                            .dataset_sha256 = row.end.found.dataset_sha256,
                            .dataset_error = row.dataset_error,
                            .bench_outcome = row.bench_outcome,
                            .bench_error = row.bench_error};
    CHECK(facts == expected);
    CHECK(facts.outcome == row.outcome);
    CHECK(facts.cleanup == row.cleanup);
    CHECK(facts.error == row.error);
  }
}

TEST_CASE("A run that does not answer has failed, unless it only concluded an older end") {
  const RunFacts stopped{.outcome = "stopped", .cleanup = "done", .dataset_error = "no room"};
  for (const bool has_rig : {true, false}) {
    const RunFacts fresh = facts_without_answer({}, has_rig, "36426411");
    CHECK(fresh.outcome == "failed");
    CHECK(fresh.cleanup == "skipped");
    CHECK(fresh.dataset_sha256 == "36426411");
    const RunFacts resumed = facts_without_answer(stopped, has_rig, "36426411");
    CHECK(resumed.outcome == (has_rig ? "failed" : "stopped"));
    CHECK(resumed.cleanup == (has_rig ? "skipped" : "done"));
    CHECK(resumed.dataset_error == (has_rig ? "" : "no room"));
    CHECK(resumed.dataset_sha256 == (has_rig ? "36426411" : ""));
    for (const RunFacts& facts : {fresh, resumed}) CHECK(facts.error == unresponsive_error);
  }
}

}  // namespace run_state_test
