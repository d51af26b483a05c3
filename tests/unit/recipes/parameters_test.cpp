// A recipe with parameters becomes one with values, or is refused if a value cannot be used.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/unit/recipes/bench.hpp"

namespace parameters_test {

using namespace weft::recipes;
using nlohmann::json;
using test::limits;
using test::small_with;
using test::with;

namespace {

const char* const declarations = R"("parameters": {
    "force_N": {"type": "number", "unit": "N", "min": 1, "max": 8, "default": 5},
    "n": {"type": "integer", "min": 1, "max": 9},
    "cloth": {"type": "text", "default": "denim"},
    "then": {"type": ["stop", "continue"], "default": "stop"}},)";

/// The small recipe with a parameter of every type that recipes can have.
std::string template_recipe(const std::string& block = declarations) {
  std::string text = small_with("\"schema_version\": 1,", "\"schema_version\": 1, " + block +
                                                              "\"on_trial_failure\": "
                                                              "{\"parameter\": \"then\"},");
  text = with(text, "\"force_N\": 5", "\"force_N\": {\"parameter\": \"force_N\"}");
  text = with(text, "[\"denim\"", "[{\"parameter\": \"cloth\"}");
  return with(text, "\"repetitions\": 2", "\"repetitions\": {\"parameter\": \"n\"}");
}

CheckReport bound(const std::string& recipe, const std::string& values) {
  return check_recipe(recipe, limits(), {}, values);
}

struct Refusal {
  const char* values;
  const char* pointer;
  const char* expected;
  const char* got;
};

}  // namespace

TEST_CASE("Values and defaults take the place of references, and the resolved recipe runs alike") {
  const CheckReport report = bound(template_recipe(), R"({"n": 2, "force_N": 3})");
  REQUIRE(report.plan);
  const json resolved = json::parse(report.recipe_json);
  CHECK(resolved["repetitions"] == 2);
  CHECK(resolved["explorations"]["M2"]["phases"][1]["force_N"] == 3.0);
  CHECK(resolved["fabrics"] == json{"denim", "silk"});
  CHECK(resolved["on_trial_failure"] == "stop");
  CHECK_FALSE(resolved.contains("parameters"));
  CHECK(resolved["bound_parameters"] ==
        json{{"force_N", 3.0}, {"n", 2}, {"cloth", "denim"}, {"then", "stop"}});
  CHECK(json::parse(report.parameters_json)["n"] ==
        json{{"type", "integer"}, {"min", 1}, {"max", 9}});

  const CheckReport again = bound(report.recipe_json, "");
  REQUIRE(again.plan);
  CHECK(again.recipe_json == report.recipe_json);
  CHECK(again.plan->canonical_json == report.plan->canonical_json);
  const CheckReport by_hand = bound(small_with("\"force_N\": 5", "\"force_N\": 3"), "");
  CHECK(by_hand.plan->canonical_json == report.plan->canonical_json);
}

TEST_CASE("Equal values give equal recipes, however they are written") {
  const std::string one = bound(template_recipe(), R"({"n": 2, "force_N": 3})").recipe_json;
  CHECK(bound(template_recipe(), R"({"force_N": 3.0, "n": 2.0})").recipe_json == one);
  CHECK(bound(template_recipe(), R"({"force_N": 3, "n": 3})").recipe_json != one);
}

TEST_CASE("A recipe without parameters stays as it was written") {
  const CheckReport report = bound(test::small_recipe, "");
  CHECK(report.recipe_json == test::small_recipe);
  CHECK(report.parameters_json == "{}");
  CHECK(bound(test::small_recipe, "{}").plan);
  const CheckReport refused = bound(test::small_recipe, R"({"force_N": 3})");
  REQUIRE(refused.problems.size() == 1);
  CHECK(refused.problems[0].pointer == "/parameters/force_N");
  CHECK(refused.problems[0].expected == "no parameters");
}

TEST_CASE("A value that does not fit its declaration is refused with its place") {
  const std::vector<Refusal> cases{
      {"", "/parameters/n", "a whole number", ""},
      {R"({"n": 2.5})", "/parameters/n", "a whole number", "2.5"},
      {R"({"n": "2"})", "/parameters/n", "a whole number", "\"2\""},
      {R"({"n": null})", "/parameters/n", "a whole number", "null"},
      {R"({"n": 10})", "/parameters/n", "1.0 to 9.0", "10"},
      {R"({"n": 1e300})", "/parameters/n", "a whole number", "1e+300"},
      {R"({"n": 2, "force_N": 8.5})", "/parameters/force_N", "1.0 to 8.0", "8.5"},
      {R"({"n": 2, "force_N": true})", "/parameters/force_N", "a number", "true"},
      {R"({"n": 2, "then": "retry"})", "/parameters/then", "stop or continue", "\"retry\""},
      {R"({"n": 2, "cloth": 7})", "/parameters/cloth", "a text", "7"},
      {R"({"n": 2, "cloth": {"parameter": "then"}})", "/parameters/cloth", "a text", "an object"},
      {R"({"n": 2, "forse_N": 3})", "/parameters/forse_N", "cloth, force_N, n or then", "forse_N"},
      {R"({"n": 2, "n": 3})", "/parameters/n", "every key once", ""},
      {R"([2])", "/parameters", "an object", "an array"},
  };
  for (const Refusal& c : cases) {
    const CheckReport report = bound(template_recipe(), c.values);
    INFO(c.values);
    CHECK_FALSE(report.plan);
    REQUIRE(report.problems.size() == 1);
    CHECK(report.problems[0].pointer == c.pointer);
    CHECK(report.problems[0].expected == c.expected);
    CHECK(report.problems[0].got == c.got);
  }
  const CheckReport unknown = bound(template_recipe(), R"({"n": 2, "forse_N": 3})");
  CHECK_THAT(unknown.problems[0].hint, Catch::Contains("force_N"));
}

TEST_CASE("The rig's limits hold for a bound value, at the place of its reference") {
  const std::string wide = with(declarations, "\"max\": 8", "\"max\": 80");
  const CheckReport report = bound(template_recipe(wide), R"({"n": 2, "force_N": 60})");
  REQUIRE_FALSE(report.problems.empty());
  CHECK(report.problems[0].pointer == "/explorations/M2/phases/1/force_N");
}

TEST_CASE("A declaration that cannot be used is refused at its place") {
  const auto refused_at = [](const std::string& from, const std::string& to) {
    const CheckReport report = bound(template_recipe(with(declarations, from, to)), R"({"n": 2})");
    CHECK_FALSE(report.plan);
    return report.problems.empty() ? std::string() : report.problems[0].pointer;
  };
  CHECK(refused_at("\"unit\": \"N\"", "\"unit\": \"mm\"") == "/parameters/force_N/unit");
  CHECK(refused_at("\"unit\": \"N\", ", "") == "/parameters/force_N/unit");
  CHECK(refused_at("\"default\": 5", "\"default\": 50") == "/parameters/force_N/default");
  CHECK(refused_at("\"min\": 1, \"max\": 8", "\"min\": 8, \"max\": 1") ==
        "/parameters/force_N/max");
  CHECK(refused_at("\"number\"", "\"real\"") == "/parameters/force_N/type");
  CHECK(refused_at("\"text\"", "\"text\", \"max\": 4") == "/parameters/cloth/max");
  CHECK(refused_at("[\"stop\", \"continue\"]", "[]") == "/parameters/then/type");
  CHECK(refused_at("\"force_N\": {", "\"force N\": {") == "/parameters/force N");
  CHECK(refused_at("\"cloth\": {\"type\"", "\"cloth\": {\"colour\": 1, \"type\"") ==
        "/parameters/cloth/colour");
  CHECK(refused_at("\"then\": {",
                   "\"unused\": {\"type\": \"flag\", \"default\": true}, \"then\": {") ==
        "/parameters/unused");
}

TEST_CASE("A reference is refused where its parameter is unknown or has another unit") {
  const auto refused_at = [](const std::string& from, const std::string& to) {
    const CheckReport report = bound(with(template_recipe(), from, to), R"({"n": 2})");
    REQUIRE_FALSE(report.problems.empty());
    return report.problems[0].pointer;
  };
  CHECK(refused_at("{\"parameter\": \"cloth\"}", "{\"parameter\": \"clot\"}") == "/fabrics/0");
  CHECK(refused_at("\"speed_mm_s\": 2", "\"speed_mm_s\": {\"parameter\": \"force_N\"}") ==
        "/explorations/M2/phases/2/speed_mm_s");
}

TEST_CASE("A recipe that grows beyond its bound by its values is refused") {
  std::string recipe = small_with(
      "\"schema_version\": 1,",
      R"("schema_version": 1, "parameters": {"words": {"type": "text"}}, "operator_steps": [)");
  recipe = with(
      recipe, "\"operator_steps\": [", "\"operator_steps\": [" + [] {
        std::string steps;
        for (int i = 0; i < 5000; ++i)
          steps += std::string(i == 0 ? "" : ",") + R"({"text": {"parameter": "words"}})";
        return steps + "],";
      }());
  const CheckReport report = bound(recipe, json{{"words", std::string(500, 'x')}}.dump());
  REQUIRE(report.problems.size() == 1);
  CHECK(report.problems[0].expected == "at most 1048576 bytes");
}

}  // namespace parameters_test
