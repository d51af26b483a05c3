// A stroke that ends when its vote is certain: the recipe's field, and its effect in the engine.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/unit/recipes/engine_bench.hpp"

namespace live_vote_test {

using namespace weft;
using namespace weft::recipes;
using test::all_of;
using test::Bench;
using test::only;
using test::small_with;

namespace {

const char* const requested =
    R"({"live_vote": {"model": "m.model", "stop_early": {"sure_probability": 0.9,
        "least_slide_s": 2}}, "phases")";

Bench bench(const char* vote = requested) {
  return Bench(test::plan_of(small_with("{\"phases\"", vote)));
}

std::vector<Diagnostic> problems_of(const std::string& vote) {
  return check_recipe(small_with("{\"phases\"", "{\"live_vote\": " + vote + ", \"phases\""),
                      test::limits())
      .problems;
}

}  // namespace

TEST_CASE("The live vote of a recipe is in its plan and in its normal form") {
  const Plan plan = bench().plan;
  REQUIRE(plan.explorations[0].live_vote);
  const LiveVote& vote = *plan.explorations[0].live_vote;
  CHECK(vote.model == "m.model");
  REQUIRE(vote.stop_early);
  CHECK(vote.stop_early->sure_probability == 0.9);
  CHECK(vote.stop_early->least_slide_s == 2);
  const auto normal = nlohmann::json::parse(plan.canonical_json);
  CHECK(normal["explorations"]["M2"]["live_vote"]["stop_early"]["sure_probability"] == 0.9);
  CHECK_FALSE(test::plan_of(test::small_recipe).explorations[0].live_vote);
}

TEST_CASE("An invalid live vote is refused at its place") {
  const std::string at = "/explorations/M2/live_vote";
  const auto only_problem = [](const std::string& vote) {
    const auto problems = problems_of(vote);
    REQUIRE(problems.size() == 1);
    return problems[0].pointer;
  };
  CHECK(only_problem(R"({"model": ""})") == at + "/model");
  CHECK(only_problem(R"({"model": "m", "stop": {}})") == at + "/stop");
  CHECK(only_problem(R"({"model": "m", "stop_early": {"sure_probability": 1.0,
                         "least_slide_s": 2}})") == at + "/stop_early/sure_probability");
  CHECK(only_problem(R"({"model": "m", "stop_early": {"sure_probability": 0.4,
                         "least_slide_s": 2}})") == at + "/stop_early/sure_probability");
  CHECK(only_problem(R"({"model": "m", "stop_early": {"sure_probability": 0.9,
                         "least_slide_s": 0}})") == at + "/stop_early/least_slide_s");
  CHECK(problems_of(R"({"model": "m", "stop_early": {}})").size() == 2);
  CHECK(problems_of(R"({"model": "m"})").empty());
}

TEST_CASE("A slide with a certain vote ends as at the end of its path, and the trial continues") {
  Bench b = bench();
  b.advance_to(Step::sliding);
  b.send(EndSlide{});
  CHECK(b.state.step == Step::releasing);
  CHECK(b.phase == Phase::none);
  CHECK_FALSE(b.force_loop);
  CHECK(only<StopMotion>(b.effects).has_value());
  CHECK(only<Ascend>(b.effects).has_value());
  b.advance_to(Step::ending);
  CHECK(b.state.step == Step::ending);
  CHECK(b.phase == Phase::end);
  b.advance_to(Step::mounting);
  REQUIRE(b.trials.size() == 1);
  CHECK(b.trials[0].outcome == Outcome::complete);
  CHECK(b.trials[0].ended_early);
}

TEST_CASE("Only the trial with the early end is marked, and the campaign is complete") {
  Bench b = bench();
  b.advance_to(Step::sliding);
  b.send(EndSlide{});
  b.finish();
  REQUIRE(b.trials.size() == 4);
  CHECK(std::count_if(b.trials.begin(), b.trials.end(),
                      [](const TrialDone& t) { return t.ended_early; }) == 1);
  REQUIRE(b.end);
  CHECK(b.end->outcome == Outcome::complete);
}

TEST_CASE("No other step, and no recipe that does not ask for it, takes the end of a slide") {
  for (const char* vote : {requested, R"({"live_vote": {"model": "m"}, "phases")", "{\"phases\""}) {
    Bench b = bench(vote);
    while (b.state.step != Step::done) {
      const State before = b.state;
      if (before.step != Step::sliding || vote != requested) {
        CHECK(b.send(EndSlide{}).empty());
        CHECK(b.state.step == before.step);
        CHECK(b.state.ticket == before.ticket);
      }
      b.advance();
    }
    CHECK(std::none_of(b.trials.begin(), b.trials.end(),
                       [](const TrialDone& t) { return t.ended_early; }));
  }
}

TEST_CASE("A failure after an early end of the slide is not complete") {
  Bench b = bench();
  b.advance_to(Step::sliding);
  b.send(EndSlide{});
  b.send(AbortRequested{});
  b.finish();
  REQUIRE(b.trials.size() == 1);
  CHECK(b.trials[0].outcome == Outcome::aborted);
  CHECK_FALSE(b.trials[0].ended_early);
}

}  // namespace live_vote_test
