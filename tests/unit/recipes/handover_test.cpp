// The handover settings of a recipe, and the division of repetitions into groups.

#include "recipes/engine/handover.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/unit/recipes/bench.hpp"

namespace handover_test {

using namespace weft::recipes;
using test::small_recipe;
using test::small_with;

namespace {

const std::string reps = "\"repetitions\": 2";

std::string with_handover(const std::string& handover, int repetitions = 20) {
  return small_with(
      reps, "\"repetitions\": " + std::to_string(repetitions) + ", \"hand_over\": " + handover);
}

void refused(const std::string& recipe, const std::string& pointer) {
  const CheckReport report = check_recipe(recipe, test::limits());
  CHECK_FALSE(report.plan);
  INFO(pointer);
  CHECK(std::any_of(report.problems.begin(), report.problems.end(),
                    [&](const Diagnostic& problem) { return problem.pointer == pointer; }));
}

}  // namespace

TEST_CASE("A hand-over is read with its defaults, and is part of the recipe's normal form") {
  CHECK_FALSE(test::plan_of(small_recipe).handover);
  const Plan plain = test::plan_of(with_handover("{}"));
  REQUIRE(plain.handover);
  CHECK(*plain.handover == Handover{"best", 5, 3600, HandoverSource::taxels});
  const Plan stated =
      test::plan_of(with_handover(R"({"learner": "lda", "groups": 4, "at_most_s": 60})"));
  CHECK(*stated.handover == Handover{"lda", 4, 60, HandoverSource::taxels});
  CHECK(nlohmann::json::parse(stated.canonical_json)["hand_over"]["groups"] == 4);
  CHECK(stated.canonical_json != plain.canonical_json);
}

TEST_CASE("A recipe without hand_over is evaluated if possible, and stays unchanged") {
  const auto repeated = [](int repetitions, const std::string& more = "") {
    return small_with(reps, "\"repetitions\": " + std::to_string(repetitions) + more);
  };
  const Plan plain = test::plan_of(repeated(3));
  REQUIRE(plain.handover);
  CHECK(*plain.handover == Handover{"best", 5, 3600, HandoverSource::taxels, true});
  CHECK_FALSE(nlohmann::json::parse(plain.canonical_json).contains("hand_over"));
  CHECK_FALSE(test::plan_of(repeated(2)).handover);
  const Plan declined = test::plan_of(repeated(3, ", \"hand_over\": false"));
  CHECK_FALSE(declined.handover);
  CHECK(nlohmann::json::parse(declined.canonical_json)["hand_over"] == false);
  CHECK_FALSE(test::plan_of(test::with(repeated(3), "\"denim\", \"silk\"", "\"denim\"")).handover);
  RigLimits without_taxels = test::limits();
  without_taxels.taxels = 0;
  const CheckReport report = check_recipe(repeated(3), without_taxels);
  REQUIRE(report.plan);
  CHECK_FALSE(report.plan->handover);
  refused(repeated(3, ", \"hand_over\": true"), "/hand_over");
}

TEST_CASE("A hand-over that could not learn is refused before anything moves") {
  refused(with_handover(R"({"learner": "forest"})"), "/hand_over/learner");
  refused(with_handover(R"({"groups": 1})"), "/hand_over/groups");
  refused(with_handover(R"({"at_most_s": 0})"), "/hand_over/at_most_s");
  refused(with_handover(R"({"lerner": "lda"})"), "/hand_over/lerner");
  // without a test group one repetition would remain; the same for three in two groups
  refused(with_handover("{}", 2), "/hand_over");
  refused(with_handover(R"({"groups": 2})", 3), "/hand_over");
  CHECK(check_recipe(with_handover("{}", 3), test::limits()).plan);
  CHECK(check_recipe(with_handover(R"({"groups": 2})", 4), test::limits()).plan);
  const std::string two = "\"denim\", \"silk\"";
  refused(test::with(with_handover("{}"), two, "\"denim\""), "/hand_over");
}

TEST_CASE("A handover from vibration needs a vibration sensor and its own learners") {
  const std::string recipe = with_handover(R"({"from": "vibration", "learner": "every"})");
  refused(recipe, "/hand_over/from");
  for (double RigLimits::*const rate :
       {&RigLimits::sound_rate_hz, &RigLimits::acceleration_rate_hz}) {
    RigLimits has_vibration = test::limits();
    has_vibration.*rate = 200;
    const CheckReport report = check_recipe(recipe, has_vibration);
    REQUIRE(report.plan);
    CHECK(report.plan->handover == Handover{"every", 5, 3600, HandoverSource::vibration});
    CHECK(nlohmann::json::parse(report.plan->canonical_json)["hand_over"]["from"] == "vibration");
    CHECK_FALSE(
        check_recipe(with_handover(R"({"from": "vibration", "learner": "lda"})"), has_vibration)
            .plan);
  }
  refused(with_handover(R"({"learner": "every"})"), "/hand_over/learner");
  // a recipe from before the key "from" existed keeps its meaning
  CHECK(test::plan_of(with_handover(R"({"from": "taxels"})")).canonical_json ==
        test::plan_of(with_handover("{}")).canonical_json);
}

TEST_CASE("Repetitions are dealt into runs of neighbours, each in one group, groups of one size") {
  CHECK(repetition_groups(4, 2) == std::vector<std::size_t>{0, 0, 1, 1});
  CHECK(repetition_groups(2, 5) == std::vector<std::size_t>{0, 1});
  for (const std::uint32_t repetitions : {3U, 7U, 20U, 101U})
    for (const std::uint32_t groups : {2U, 3U, 5U, 7U}) {
      INFO(repetitions << " repetitions in " << groups);
      const auto group = repetition_groups(repetitions, groups);
      REQUIRE(group.size() == repetitions);
      CHECK(std::is_sorted(group.begin(), group.end()));
      const std::size_t used = std::min(repetitions, groups);
      for (std::size_t g = 0; g < used; ++g) {
        const auto size = static_cast<std::size_t>(std::count(group.begin(), group.end(), g));
        CHECK(size >= repetitions / used);
        CHECK(size <= (repetitions + used - 1) / used);
      }
    }
}

}  // namespace handover_test
