// The open operator prompt, and the confirmation that it accepts, with the time as an argument.

#include "daemon/service/run_model/operator_prompts.hpp"

#include <catch2/catch.hpp>

namespace operator_prompts_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using namespace std::chrono_literals;

namespace {

recipes::StepPrompt query(const char* text) {
  return {.trial = 0, .step = 0, .text = text, .people_s = 30};
}

RunStatusUpdate asking(recipes::Ticket ticket, const char* text) {
  RunStatusUpdate moment;
  moment.requested = recipes::PromptOperator{ticket, query(text)};
  return moment;
}

}  // namespace

TEST_CASE("a prompt that opens has a name of its own, its time and its ticket") {
  OperatorPrompts prompts(11);
  CHECK(prompts.on_step(1, RunState::awaiting_operator, asking(5, "mount a1"), 3s));
  REQUIRE(prompts.find(1) != nullptr);
  CHECK(prompts.find(1)->step == "Q-12");
  CHECK(prompts.find(1)->prompt.text == "mount a1");
  CHECK(prompts.find(1)->at == 3s);
  CHECK(prompts.ticket(1) == 5);
  CHECK(prompts.check(1, "Q-12"));
  const Status refused = prompts.check(1, "Q-11");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::wrong_state);
  CHECK(refused.error().expected == "Q-12");
  CHECK(prompts.on_step(1, RunState::awaiting_operator, asking(6, "mount a2"), 4s));
  CHECK(prompts.find(1)->step == "Q-13");
  CHECK(prompts.ticket(1) == 6);
  CHECK(prompts.find(2) == nullptr);
  CHECK(prompts.ticket(2) == 0);
}

TEST_CASE("the next prompt is known from the plan, and then from the running campaign") {
  OperatorPrompts prompts;
  prompts.on_plan(1, query("mount a1"));
  CHECK(prompts.find(1)->step.empty());
  CHECK_FALSE(prompts.find(1)->at);
  CHECK_FALSE(prompts.check(1, "Q-1"));
  RunStatusUpdate moment;
  moment.next_prompt = query("mount a2");
  CHECK_FALSE(prompts.on_step(1, RunState::running, moment, 10s));
  CHECK(prompts.find(1)->prompt.text == "mount a2");
  CHECK_FALSE(prompts.find(1)->at);
  prompts.on_step(1, RunState::running, RunStatusUpdate(), 12s);
  CHECK(prompts.find(1) == nullptr);
  prompts.on_plan(1, query("mount a1"));
  prompts.on_plan(1, std::nullopt);
  CHECK(prompts.find(1) == nullptr);
}

TEST_CASE("a step that asks nothing and runs nothing leaves the prompt as it is") {
  OperatorPrompts prompts;
  prompts.on_step(1, RunState::awaiting_operator, asking(5, "mount a1"), 0s);
  for (const RunState state : {RunState::awaiting_operator, RunState::held, RunState::pausing})
    CHECK_FALSE(prompts.on_step(1, state, RunStatusUpdate(), 1s));
  CHECK(prompts.find(1)->step == "Q-1");
}

TEST_CASE("a run has prompts until it is finishing, and none is open while it is held") {
  for (const RunState state : all_run_states) {
    INFO(to_string(state));
    OperatorPrompts prompts;
    prompts.on_plan(1, query("mount a1"));
    prompts.on_plan(2, query("mount a1"));
    prompts.on_state(1, state);
    const bool needs = state < RunState::finishing;
    CHECK((prompts.find(1) != nullptr) == needs);
    CHECK(prompts.find(2) != nullptr);
  }
}

}  // namespace operator_prompts_test
