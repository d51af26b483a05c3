// Operator steps between trials: in the recipe, in the plan and its time, and in the engine.

#include <algorithm>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "recipes/engine/operator_steps.hpp"
#include "tests/unit/recipes/engine_bench.hpp"

namespace operator_steps_test {

using namespace weft;
using namespace weft::recipes;
using test::Bench;
using test::only;
using test::small_with;

namespace {

const char* const reps = "\"repetitions\": 2";

std::string asking(const std::string& steps, const std::string& more = "") {
  return small_with(reps, reps + (", \"operator_steps\": " + steps) + more);
}

const char* const mount_each =
    R"([{"before": "campaign", "text": "Clean the probe.", "people_s": 30},
        {"before": "fabric", "text": "Mount {fabric}, number {number}.", "people_s": 90},
        {"before": "fabric", "fabrics": ["silk"], "text": "Smooth the {fabric}.", "people_s": 15}])";

Bench bench() {
  return Bench(test::plan_of(asking(mount_each)));
}

std::vector<Diagnostic> problems_of(const std::string& steps) {
  return check_recipe(asking(steps), test::limits()).problems;
}

std::string only_problem(const std::string& steps) {
  const auto problems = problems_of(steps);
  INFO(steps);
  REQUIRE(problems.size() == 1);
  return problems[0].pointer;
}

/// All prompts until the campaign ends, each with its trial.
std::vector<std::string> prompts_in(Bench& b) {
  std::vector<std::string> out;
  while (b.state.step != Step::done) {
    b.advance();
    if (const auto requested = only<PromptOperator>(b.effects))
      out.push_back(std::to_string(requested->prompt.trial) + " " + requested->prompt.text);
  }
  return out;
}

}  // namespace

TEST_CASE("On a real bench a person mounts every fabric, with or without a step in the recipe") {
  RigLimits real = test::limits();
  real.bench = "real";
  const auto planned = [&](const std::string& recipe) {
    const CheckReport report = check_recipe(recipe, real);
    REQUIRE(report.plan);
    return report;
  };
  const CheckReport silent = planned(test::small_recipe);
  const Plan& plan = *silent.plan;
  REQUIRE(plan.operator_steps.size() == 1);
  CHECK(step_prompt(plan, 0, 0).text == "Mount " + plan.fabrics[0] + ", then confirm.");
  CHECK(plan.forecast.prompts == plan.fabrics.size());
  const auto about_people = [](const Diagnostic& one) { return one.pointer == "/operator_steps"; };
  CHECK(std::ranges::count_if(silent.warnings, about_people) == 1);
  CHECK(plan.canonical_json == test::plan_of(test::small_recipe).canonical_json);

  const CheckReport whole = planned(asking(mount_each));
  CHECK(whole.plan->operator_steps.size() == 3);
  CHECK(std::ranges::none_of(whole.warnings, about_people));

  const CheckReport some = planned(asking(R"([{"before": "fabric", "fabrics": ["silk"],
      "text": "Mount {fabric}.", "people_s": 15}])"));
  REQUIRE(some.plan->operator_steps.size() == 2);
  CHECK(some.plan->operator_steps[1].fabrics == std::vector<std::size_t>{0});
  CHECK(some.plan->forecast.prompts == some.plan->fabrics.size());
}

TEST_CASE("The operator steps of a recipe are in its plan, its time and its normal form") {
  const Plan plan = test::plan_of(asking(mount_each));
  const Plan without = test::plan_of(test::small_recipe);
  REQUIRE(plan.operator_steps.size() == 3);
  CHECK(plan.operator_steps[2].fabrics == std::vector<std::size_t>{1});
  CHECK(plan.forecast.prompts == 4);
  CHECK(plan.forecast.people_s == Approx(30 + 90 + 90 + 15));
  CHECK(plan.forecast.duration_s == without.forecast.duration_s);
  CHECK(plan.forecast.total_s() == Approx(plan.forecast.duration_s + 225));
  const auto normal = nlohmann::json::parse(plan.canonical_json);
  CHECK(normal["operator_steps"][2]["fabrics"][0] == "silk");
  CHECK_FALSE(nlohmann::json::parse(without.canonical_json).contains("operator_steps"));
}

TEST_CASE("The next human action of a plan is found from any trial on") {
  const Plan plan = test::plan_of(asking(mount_each));
  CHECK(next_prompt(plan, 0)->text == "Clean the probe.");
  CHECK(next_prompt(plan, 1)->text == "Mount silk, number 2.");
  CHECK(next_prompt(plan, 1)->trial == 2);
  CHECK_FALSE(next_prompt(plan, 3));
  CHECK(people_forecast(plan, 1).people_s == Approx(105));
  CHECK(machine_s(plan, 0, 4) == Approx(plan.forecast.duration_s));
  CHECK_FALSE(next_prompt(test::plan_of(test::small_recipe), 0));
}

TEST_CASE("An invalid operator step is refused at its place") {
  const std::string at = "/operator_steps/0";
  CHECK(only_problem("[]") == "/operator_steps");
  CHECK(only_problem("[3]") == at);
  CHECK(only_problem(R"([{"before": "lunch", "text": "x", "people_s": 1}])") == at + "/before");
  CHECK(only_problem(R"([{"before": "fabric", "text": "", "people_s": 1}])") == at + "/text");
  CHECK(only_problem(R"([{"before": "fabric", "text": "{colour}", "people_s": 1}])") ==
        at + "/text");
  CHECK(only_problem(R"([{"before": "fabric", "text": "a\nb", "people_s": 1}])") == at + "/text");
  CHECK(only_problem(R"([{"before": "fabric", "text": "x", "people_s": -1}])") == at + "/people_s");
  CHECK(only_problem(R"([{"before": "fabric", "text": "x", "people_min": 1, "people_s": 1}])") ==
        at + "/people_min");
  CHECK(
      only_problem(R"([{"before": "fabric", "fabrics": ["sulk"], "text": "x", "people_s": 1}])") ==
      at + "/fabrics/0");
  CHECK(only_problem(
            R"([{"before": "campaign", "fabrics": ["silk"], "text": "x", "people_s": 1}])") ==
        at + "/fabrics");
  CHECK(problems_of(R"([{"before": "fabric"}])").size() == 2);
}

TEST_CASE("An order that changes the fabric again and again is warned of") {
  const char* const shuffled = R"(, "order": {"kind": "randomised", "seed": 5})";
  const auto warned = check_recipe(asking(mount_each, shuffled), test::limits());
  REQUIRE(warned.plan);
  CHECK(warned.plan->forecast.prompts > 4);
  const auto blocked = check_recipe(asking(mount_each), test::limits());
  CHECK(warned.warnings.size() ==
        // about the order
        blocked.warnings.size() + 1 + (warned.plan->forecast.prompts > 6 ? 1 : 0));
}

TEST_CASE("People are asked before the campaign and at each change of fabric, and not else") {
  Bench b = bench();
  CHECK(prompts_in(b) == std::vector<std::string>{"0 Clean the probe.", "0 Mount denim, number 1.",
                                                  "2 Mount silk, number 2.", "2 Smooth the silk."});
  CHECK(b.end->outcome == Outcome::complete);
  CHECK(b.trials.size() == 4);
}

TEST_CASE("While a person is at work no trial is open, the probe is up, and then goes up again") {
  Bench b = bench();
  b.advance_to(Step::retracting);
  for (const std::size_t before = 2; b.trials.size() < before;) b.advance();
  CHECK(b.state.step == Step::awaiting_operator);
  CHECK(b.commanded_z_m == Approx(0.092));
  CHECK_FALSE(only<TrialBegin>(b.effects));
  CHECK(b.timer->deadline == b.now + longest_hold);
  b.advance();
  CHECK(only<PromptOperator>(b.effects)->prompt.text == "Smooth the silk.");
  b.advance();
  CHECK(only<TrialBegin>(b.effects)->trial == 2);
  CHECK(b.state.step == Step::clearing);
}

TEST_CASE("A confirmation of another step than the one that is asked changes nothing") {
  Bench b = bench();
  b.advance();
  REQUIRE(b.state.step == Step::awaiting_operator);
  const Ticket first = b.state.ticket;
  b.advance();
  REQUIRE(b.state.step == Step::awaiting_operator);
  CHECK(b.send(OperatorConfirmed{first}).empty());
  CHECK(b.send(OperatorConfirmed{b.state.ticket + 1}).empty());
  CHECK(b.send(Mounted{b.state.ticket}).empty());
  b.advance();
  CHECK(b.state.step == Step::clearing);
  CHECK(b.send(OperatorConfirmed{b.state.ticket}).empty());
}

TEST_CASE("While a person is awaited, stop, abort, halt, a fault and a day's patience end it") {
  const auto ends_as = [](const Event& event, Outcome outcome, RigFact rig) {
    Bench b = bench();
    b.advance();
    b.send(event);
    REQUIRE(b.end);
    CHECK(b.end->outcome == outcome);
    CHECK(b.end->rig == rig);
    CHECK(b.trials.empty());
  };
  const Error broken{.code = Errc::device, .where = "stage.z", .what = "broken"};
  ends_as(StopRequested{}, Outcome::stopped, RigFact::safe);
  ends_as(AbortRequested{}, Outcome::aborted, RigFact::safe);
  ends_as(HaltRequested{}, Outcome::aborted, RigFact::holding);
  ends_as(Fault{broken}, Outcome::failed, RigFact::safe);
  ends_as(GuardTripped{{Guard::travel, GuardAction::end_campaign, broken}}, Outcome::failed,
          RigFact::safe);
  Bench b = bench();
  b.advance();
  b.send(TimerExpired{b.state.ticket});
  CHECK(b.end->outcome == Outcome::stopped);
}

TEST_CASE("A pause holds while a person is awaited, and what was not confirmed is asked again") {
  for (const bool at_once : {false, true}) {
    Bench b = bench();
    b.advance();
    b.advance();
    const std::string requested = only<PromptOperator>(b.effects)->prompt.text;
    b.send(PauseRequested{at_once});
    CHECK(b.state.step == Step::held);
    b.send(ResumeRequested{});
    CHECK(only<PromptOperator>(b.effects)->prompt.text == requested);
    b.finish();
    CHECK(b.trials.size() == 4);
    CHECK(b.end->outcome == Outcome::complete);
  }
}

TEST_CASE("A person who presses on the plate between trials fails no trial") {
  Bench b = bench();
  b.advance();
  const Error high{.code = Errc::safety, .what = "the force is over the cap"};
  CHECK(b.send(GuardTripped{{Guard::force_cap, GuardAction::fail_trial, high}}).empty());
  const Error beyond{.code = Errc::safety, .what = "the sensor's readings are not valid"};
  const GuardTrip saturated{Guard::invalid_wrench, GuardAction::end_campaign, beyond};
  CHECK(b.send(GuardTripped{saturated}).empty());
  CHECK(b.state.step == Step::awaiting_operator);
  b.advance_to(Step::clearing);
  b.send(GuardTripped{saturated});  // it still is, without an operator
  b.finish();
  CHECK(b.end->outcome == Outcome::failed);
}

TEST_CASE("A confirmed step is not requested again for another attempt or after a pause") {
  Plan plan = test::plan_of(asking(mount_each));
  plan.repeat_bad.emplace().at_most = 2;
  Bench b(plan);
  b.advance_to(Step::retracting);
  b.send(AttemptRejected{{.code = Errc::device, .where = "taxel 5", .what = "a taxel is dead"}});
  b.advance();
  CHECK(b.state.step == Step::mounting);
  b.advance_to(Step::sliding);
  b.send(PauseRequested{true});
  b.advance_to(Step::held);
  b.send(ResumeRequested{});
  CHECK(b.state.step == Step::clearing);
}

TEST_CASE("A resumed campaign requests the fabric on the plate again") {
  Bench b = bench();
  b.send(Start{3});
  CHECK(only<PromptOperator>(b.effects)->prompt.text == "Clean the probe.");
  b.advance();
  CHECK(only<PromptOperator>(b.effects)->prompt.text == "Mount silk, number 2.");
  b.advance();
  b.advance();
  CHECK(only<TrialBegin>(b.effects)->trial == 3);
}

}  // namespace operator_steps_test
