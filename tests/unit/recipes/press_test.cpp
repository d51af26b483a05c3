// Explorations that only press, for imprints; classes; their handover.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/unit/recipes/engine_bench.hpp"

namespace press_test {

using namespace weft;
using namespace weft::recipes;
using test::all_of;
using test::with;

namespace {

const std::string press_recipe = R"({
  "schema_version": 1, "name": "presses", "fabrics": ["a", "b", "c"], "repetitions": 2,
  "classes": {"soft": ["a", "c"], "hard": ["b"]},
  "explorations": {"P1": {"kind": "press", "phases": [
    {"phase": "S", "duration_s": 1},
    {"phase": "P", "force_N": 5, "duration_s": 2},
    {"phase": "E", "duration_s": 1}]}}})";

RigLimits array_limits() {
  RigLimits limits = test::limits();
  limits.imprint_array = true;
  limits.taxel_rate_hz = 5;
  return limits;
}

std::string problem_of(const std::string& recipe, const RigLimits& limits = array_limits()) {
  const CheckReport report = check_recipe(recipe, limits);
  CHECK_FALSE(report.plan);
  std::string all;
  for (const Diagnostic& problem : report.problems) all += to_string(problem) + "\n";
  return all;
}

bool says(const std::string& recipe, const std::string& words) {
  const std::string all = problem_of(recipe);
  INFO(all << " should say " << words);
  CHECK(all.find(words) != std::string::npos);
  return true;
}

std::string with_handover(const std::string& members) {
  return with(press_recipe, "\"repetitions\": 2",
              "\"repetitions\": 1, \"hand_over\": {\"from\": \"imprints\"" + members + "}");
}

}  // namespace

TEST_CASE("A press goes from P back to rest and never slides") {
  test::Bench b(test::plan_of(press_recipe));
  CHECK_FALSE(b.plan.explorations[0].slides());
  CHECK(b.plan.explorations[0].held_phase() == Phase::press);
  std::vector<Step> steps;
  std::string phases;
  for (b.advance(); b.trials.empty(); b.advance()) {
    steps.push_back(b.state.step);
    for (const SetPhase& e : all_of<SetPhase>(b.effects)) phases += to_char(e.phase);
  }
  const std::vector<Step> expected{
      Step::clearing,  Step::mounting,  Step::positioning, Step::biasing,   Step::approaching,
      Step::seating,   Step::lowering,  Step::resting,     Step::pressing,  Step::holding,
      Step::releasing, Step::unloading, Step::ending,      Step::retracting};
  CHECK(steps == expected);
  CHECK(phases == "S-P-E-");
  CHECK_FALSE(b.force_loop);
  b.finish();
  CHECK(b.trials.size() == 6);
}

TEST_CASE("A press lies in the middle of the plate, and its time is that of its phases") {
  const Plan press = test::plan_of(press_recipe);
  CHECK(press.explorations[0].start_m.x_m == Approx(0.075));
  CHECK(press.explorations[0].start_m.y_m == Approx(0.075));
  const Plan longer = test::plan_of(with(press_recipe, "\"duration_s\": 2", "\"duration_s\": 12"));
  CHECK(longer.forecast.duration_s - press.forecast.duration_s == Approx(60));
  says(with(press_recipe, "\"kind\": \"press\",",
            R"("kind": "press", "start": {"x_mm": 149, "y_mm": 75},)"),
       "/explorations/P1/phases: path outside");
}

TEST_CASE("A press has no phase M, and a slide has one") {
  const std::string motion =
      R"({"phase": "M", "speed_mm_s": 2, "path": [{"dx_mm": 0, "dy_mm": 5}]}, {"phase": "E")";
  says(with(press_recipe, "{\"phase\": \"E\"", motion), "phase M not");
  says(with(press_recipe, "\"kind\": \"press\",", ""), "phase M missing");
  says(with(press_recipe, "\"kind\": \"press\"", "\"kind\": \"stamp\""), "/explorations/P1/kind");
  says(with(press_recipe, "\"kind\": \"press\"",
            "\"kind\": \"press\", \"live_vote\": {\"model\": \"a.model\"}"),
       "/explorations/P1/live_vote: live vote");
}

TEST_CASE("Each fabric is in one class, or the recipe has none") {
  CHECK(test::plan_of(press_recipe).class_of == std::vector<std::string>{"soft", "hard", "soft"});
  CHECK(test::plan_of(test::small_recipe).class_of.empty());
  const std::string canonical = test::plan_of(press_recipe).canonical_json;
  CHECK(nlohmann::json::parse(canonical)["classes"]["soft"] == nlohmann::json{"a", "c"});
  const std::string classes = R"({"soft": ["a", "c"], "hard": ["b"]})";
  says(with(press_recipe, classes, R"({"soft": ["a", "c"], "hard": ["d"]})"),
       "/classes/hard/0: fabric not");
  says(with(press_recipe, classes, R"({"soft": ["a", "c"], "hard": ["b", "a"]})"),
       ": a in hard (expected");
  says(with(press_recipe, classes, R"({"soft": ["a"], "hard": ["b"]})"),
       "/classes: fabric without a class: c (");
  says(with(press_recipe, classes, R"({"all": ["a", "b", "c"]})"), "at least 2 classes");
  says(with(press_recipe, classes, R"({"soft": ["a", "b", "c"], "hard": []})"), "/classes/hard");
}

TEST_CASE("Imprints are handed over of presses in classes, also of one repetition") {
  std::string three = with(with_handover(""), R"("hard": ["b"])", R"("hard": ["b", "e", "f"])");
  three = with(three, R"("soft": ["a", "c"])", R"("soft": ["a", "c", "d"])");
  three = with(three, R"(["a", "b", "c"])", R"(["a", "b", "c", "d", "e", "f"])");
  const CheckReport report = check_recipe(three, array_limits());
  REQUIRE(report.plan);
  const Plan& plan = *report.plan;
  REQUIRE(plan.handover);
  // A class with one object has nothing left; two objects with one imprint each leave one.
  says(with_handover(""), "/classes/hard: too few");
  says(with_handover(""), "/classes/soft: too few");
  CHECK(problem_of(three, test::limits()).find("sim/rigs/imprint12.json") != std::string::npos);
  says(with(three, R"("force_N": 5, "duration_s": 2)", R"("force_N": 5, "duration_s": 0.1)"),
       "/hand_over/from: phase P");
  says(with(three, R"("repetitions")", R"("repeat_bad": {"at_most": 1}, "repetitions")"),
       "/repeat_bad");
  CHECK(plan.handover->from == HandoverSource::imprints);
  CHECK(nlohmann::json::parse(plan.canonical_json)["hand_over"]["from"] == "imprints");
  says(with_handover(", \"groups\": 4"), "/hand_over/groups");
  says(with(with_handover(""), R"("classes": {"soft": ["a", "c"], "hard": ["b"]},)", ""),
       "classes missing");
  says(test::small_with("\"repetitions\": 2",
                        R"("repetitions": 9, "hand_over": {"from": "imprints"})"),
       "(expected presses only)");
}

TEST_CASE("The library's imprints are the paper's 24, and an array's rows and columns are taxels") {
  const auto rig = parse_rig_limits(test::source_file("sim/rigs/imprint12.json"));
  REQUIRE(rig);
  CHECK(rig->taxels == 1024);
  CHECK(rig->taxel_rate_hz == 5);
  const CheckReport report = check_recipe(test::source_file("recipes/library/imprint.json"), *rig);
  REQUIRE(report.plan);
  CHECK(report.plan->trials.size() == 24);
  CHECK(report.plan->forecast.force_n->max == 50);
}

}  // namespace press_test
