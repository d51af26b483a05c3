// Every verb in every state of a run, tried on a run manager: the table at the end of
// docs/reference/run-states.md has the results. With WEFT_WRITE_DOCS in the environment it is
// written again. SIMULATED.

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace verb_table_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::RunManagerBench;
using test::TemporaryFolder;

namespace {

const std::filesystem::path verbs_page = WEFT_SOURCE_DIR "/docs/reference/run-states.md";

/// A row of the page: a state; in the last row that of a run with trials left.
struct VerbRow {
  RunState state;
  bool has_rest = false;
};
std::string name_of(VerbRow row) {
  return std::string(to_string(row.state)) + (row.has_rest ? ", trials left" : "");
}

std::string verb_recipe(RunState state) {
  if (state != RunState::awaiting_operator) return test::tiny_recipe(2);
  auto recipe = nlohmann::json::parse(test::tiny_recipe(2));
  recipe["operator_steps"] = nlohmann::json::parse(
      R"([{"before": "campaign", "text": "Clean the probe.", "people_s": 30}])");
  return recipe.dump();
}

/// A run manager with one run in a state. Messages of the run's thread are handled only when the
/// test waits for them.
struct VerbCase {
  TemporaryFolder folder;
  std::unique_ptr<RunManagerBench> bench;
  std::string id;

  explicit VerbCase(VerbRow row) {
    const RunState state = row.state;
    if (state == RunState::interrupted) leave_interrupted(folder);
    bench = std::make_unique<RunManagerBench>(folder, verb_recipe(state));
    if (state == RunState::interrupted) {
      id = bench->manager->loaded().front().stored.id();
    } else {
      if (state == RunState::queued) REQUIRE(bench->manager->pause_queue("test"));
      id = bench->submit().stored.id();
      if (row.has_rest) reach(RunState::aborting);
      reach(state);
    }
    INFO(to_string(state));
    REQUIRE(now() == state);
  }

  [[nodiscard]] RunState now() const { return bench->manager->get(id)->machine.state; }

 private:
  void until(RunState state) {
    REQUIRE(bench->posted.run_until([&] { return now() == state; }));
  }
  void order(Order order) { REQUIRE(bench->manager->order(id, order, "test")); }
  void reach(RunState state) {
    switch (state) {
      case RunState::awaiting_operator:
      case RunState::running:
      case RunState::ended:
        return until(state);
      case RunState::pausing:
        until(RunState::running);
        return order(Order::pause);
      case RunState::held:
        reach(RunState::pausing);
        return until(state);
      case RunState::resuming:
        reach(RunState::held);
        return order(Order::resume);
      case RunState::finishing:
        until(RunState::running);
        return order(Order::stop);
      case RunState::aborting:
        until(RunState::running);
        return order(Order::abort);
      case RunState::halting:
        until(RunState::running);
        return order(Order::halt);
      default:  // queued and arming are where a run begins
        return;
    }
  }
};

template <class T>
Status status_of(const Result<T>& result) {
  if (result) return {};
  return pass(result.error());
}

struct Verb {
  const char* name;
  Status (*say)(VerbCase& of);
};

template <Order order>
Status order_plain(VerbCase& of) {
  return status_of(of.bench->manager->order(of.id, order, "test"));
}

template <Recovery choice>
Status order_settle(VerbCase& of) {
  std::optional<Status> reply;
  of.bench->manager->settle(of.id, choice, "test",
                            [&](const Result<RunView>& run) { reply = status_of(run); });
  REQUIRE(of.bench->posted.run_until([&] { return reply.has_value(); }));
  return *reply;
}

Status order_confirm(VerbCase& of) {
  const auto requested = of.bench->manager->get(of.id)->operator_prompt;
  return status_of(
      of.bench->manager->order(of.id, Order::confirm, "test", requested ? requested->step : "Q-1"));
}

constexpr std::array all_verbs{
    Verb{"run.pause", order_plain<Order::pause>},
    Verb{"run.pause at once", order_plain<Order::pause_now>},
    Verb{"run.resume", order_plain<Order::resume>},
    Verb{"run.confirm", order_confirm},
    Verb{"run.stop", order_plain<Order::stop>},
    Verb{"run.abort", order_plain<Order::abort>},
    Verb{"run.withdraw",
         [](VerbCase& of) -> Status { return of.bench->manager->remove(of.id, "test"); }},
    Verb{"queue.move",
         [](VerbCase& of) -> Status {
           return of.bench->manager->edit(of.id, {.place = 0}, "test");
         }},
    Verb{"run.recover, resume",
         [](VerbCase& of) -> Status { return status_of(of.bench->recover(of.id, "test")); }},
    Verb{"run.recover, discard", order_settle<Recovery::discard>},
    Verb{"run.recover, keep-partial", order_settle<Recovery::keep_partial>},
    Verb{"rig.halt",
         [](VerbCase& of) -> Status {
           of.bench->manager->halt(RigState::Stop::halt, "test");
           return Status{};
         }},
    Verb{"rig.estop",
         [](VerbCase& of) -> Status {
           of.bench->manager->halt(RigState::Stop::emergency, "test");
           return Status{};
         }},
    Verb{"rig.reset",
         [](VerbCase& of) -> Status { return of.bench->manager->reset("looked at it", "test"); }},
    Verb{"rig.lock",
         [](VerbCase& of) -> Status {
           return of.bench->manager->lock_out({"ada", "cable", 1}, "test");
         }},
    Verb{"rig.unlock",
         [](VerbCase& of) -> Status { return of.bench->manager->unlock({"ada"}, "test"); }},
    Verb{"run.start, another", [](VerbCase& of) -> Status {
           return status_of(of.bench->submit({of.bench->request.recipe, {}, {}, "test"}));
         }}};

/// Effect of each verb on the state, cell by cell; a refused verb changes nothing.
std::string verb_row(VerbRow row) {
  auto at = std::make_unique<VerbCase>(row);
  const bool timed =
      at->bench->manager->get(at->id)->machine.deadline < RunStateMachine::Clock::max();
  std::string out = "| " + name_of(row) + " | " + (timed ? "yes" : "-") + " |";
  for (const Verb& verb : all_verbs) {
    INFO(name_of(row) << ", " << verb.name);
    const Status reply = verb.say(*at);
    const bool taken = reply.has_value();
    out += taken ? " " + std::string(to_string(at->now())) + " |" : " - |";
    if (taken) {
      at.reset();  // its threads first: the next case may fork, and a lock that they hold would
                   // stay locked
      at = std::make_unique<VerbCase>(row);
    } else {
      CHECK(at->now() == row.state);
      CHECK(reply.error().code == Errc::wrong_state);
      CHECK_FALSE(reply.error().what.empty());
    }
  }
  return out + "\n";
}

std::string verb_table() {
  std::string head = "| state | deadline |", rule = "|---|---|", rows;
  for (const Verb& verb : all_verbs) {
    head += " " + std::string(verb.name) + " |";
    rule += "---|";
  }
  for (const RunState state : all_run_states) rows += verb_row({state});
  rows += verb_row({RunState::ended, true});
  return head + "\n" + rule + "\n" + rows;
}

}  // namespace

TEST_CASE("Every verb in every state does what its page lists") {
  const std::string table = verb_table();
  std::string page = test::read_file(verbs_page);
  const std::size_t begin = page.find("| state | deadline |");
  REQUIRE(begin != std::string::npos);
  if (std::getenv("WEFT_WRITE_DOCS") != nullptr) {
    page = page.substr(0, begin) + table;
    test::write_file(verbs_page, page);
  }
  CHECK(page.substr(begin) == table);
}

}  // namespace verb_table_test
