// Every verb in every state of a run, tried on a desk: docs/reference/run-verbs.md is what came of
// it. With WEFT_WRITE_DOCS in the environment the page is written anew. SIMULATED.

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/unit/daemon/desk_bench.hpp"

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::control;
using test::DeskBench;
using test::TemporaryFolder;

namespace {

const std::filesystem::path verbs_page = "docs/reference/run-verbs.md";

std::string verb_recipe(RunState state) {
  if (state != RunState::awaiting_operator) return test::tiny_recipe(2);
  auto recipe = nlohmann::json::parse(test::tiny_recipe(2));
  recipe["operator_steps"] = nlohmann::json::parse(
      R"([{"before": "campaign", "text": "Clean the probe.", "people_s": 30}])");
  return recipe.dump();
}

/// A desk with one run in a state. What the run's thread says is not heard unless it is waited for.
struct VerbCase {
  TemporaryFolder folder;
  std::unique_ptr<DeskBench> bench;
  std::string id;

  explicit VerbCase(RunState state) {
    if (state == RunState::interrupted) leave_interrupted(folder);
    bench = std::make_unique<DeskBench>(folder, verb_recipe(state));
    if (state == RunState::interrupted) {
      id = bench->desk->all().front().stored.id();
    } else {
      if (state == RunState::queued) REQUIRE(bench->desk->hold_line("test"));
      id = bench->submit().stored.id();
      reach(state);
    }
    INFO(to_string(state));
    REQUIRE(now() == state);
  }

  [[nodiscard]] RunState now() const { return bench->desk->get(id)->machine.state; }

 private:
  void until(RunState state) {
    REQUIRE(bench->posted.run_until([&] { return now() == state; }));
  }
  void order(Order order) { REQUIRE(bench->desk->order(id, order, "test")); }
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

struct Verb {
  const char* name;
  bool (*say)(VerbCase& of);  ///< false: refused
};

template <Order order>
bool say_order(VerbCase& of) {
  return of.bench->desk->order(of.id, order, "test").has_value();
}

template <Recovery choice>
bool say_settle(VerbCase& of) {
  std::optional<bool> fine;
  of.bench->desk->settle(of.id, choice, "test",
                         [&](const Result<RunView>& run) { fine = run.has_value(); });
  REQUIRE(of.bench->posted.run_until([&] { return fine.has_value(); }));
  return *fine;
}

bool say_confirm(VerbCase& of) {
  const auto asked = of.bench->desk->get(of.id)->attention;
  return of.bench->desk->confirm(of.id, asked ? asked->step : "Q-1", "test").has_value();
}

constexpr std::array all_verbs{
    Verb{"run.pause", say_order<Order::pause>},
    Verb{"run.pause at once", say_order<Order::pause_now>},
    Verb{"run.resume", say_order<Order::resume>},
    Verb{"run.confirm", say_confirm},
    Verb{"run.stop", say_order<Order::stop>},
    Verb{"run.abort", say_order<Order::abort>},
    Verb{"run.withdraw",
         [](VerbCase& of) { return of.bench->desk->withdraw(of.id, "test").has_value(); }},
    Verb{"queue.move",
         [](VerbCase& of) { return of.bench->desk->move(of.id, 0, "test").has_value(); }},
    Verb{"run.recover, resume",
         [](VerbCase& of) { return of.bench->desk->recover(of.id, "test").has_value(); }},
    Verb{"run.recover, discard", say_settle<Recovery::discard>},
    Verb{"run.recover, keep-partial", say_settle<Recovery::keep_partial>},
    Verb{"rig.halt",
         [](VerbCase& of) {
           of.bench->desk->halt("test");
           return true;
         }},
    Verb{"rig.estop",
         [](VerbCase& of) {
           of.bench->desk->emergency_stop("test");
           return true;
         }},
    Verb{"rig.reset",
         [](VerbCase& of) { return of.bench->desk->reset("looked at it", "test").has_value(); }},
    Verb{"run.start, another", [](VerbCase& of) {
           return of.bench->desk->submit({of.bench->request.recipe, {}, {}, "test"}).has_value();
         }}};

/// What each verb makes of the state, cell by cell; a verb that is refused changes nothing.
std::string verb_row(RunState state) {
  auto at = std::make_unique<VerbCase>(state);
  const bool timed = at->bench->desk->get(at->id)->machine.deadline < RunMachine::Clock::max();
  std::string out = "| " + std::string(to_string(state)) + " | " + (timed ? "yes" : "-") + " |";
  for (const Verb& verb : all_verbs) {
    INFO(to_string(state) << ", " << verb.name);
    const bool taken = verb.say(*at);
    out += taken ? " " + std::string(to_string(at->now())) + " |" : " - |";
    if (taken) {
      at = std::make_unique<VerbCase>(state);
    } else {
      CHECK(at->now() == state);
    }
  }
  return out + "\n";
}

std::string whole_verbs_page() {
  std::string head = "| state | deadline |", rule = "|---|---|", rows;
  for (const Verb& verb : all_verbs) {
    head += " " + std::string(verb.name) + " |";
    rule += "---|";
  }
  for (const RunState state : all_run_states) rows += verb_row(state);
  return "# Every verb in every state of a run\n\n"
         "Tried one by one by `tests/unit/daemon/verb_table_test.cpp`, which fails where this "
         "verbs_page "
         "says otherwise. A cell is the state\nright after the verb, `-`: refused with "
         "`wrong_state` and a sentence that says what the state takes. A state with a deadline\n"
         "that passes climbs the ladder pause, stop, abort, halt; one without waits for "
         "people.\n\n" +
         head + "\n" + rule + "\n" + rows;
}

}  // namespace

TEST_CASE("Every verb in every state does what the page of them says") {
  const std::string told = whole_verbs_page();
  if (std::getenv("WEFT_WRITE_DOCS") != nullptr) test::write_file(verbs_page, told);
  CHECK(test::read_file(verbs_page) == told);
}
