#include <catch2/catch.hpp>

#include "tests/unit/recipes/bench.hpp"

namespace check_test {

using namespace weft::recipes;
using weft::recipes::test::limits;
using weft::recipes::test::small_recipe;
using weft::recipes::test::small_with;
using weft::recipes::test::with;

namespace {

std::vector<Diagnostic> problems_of(const std::string& recipe) {
  const CheckReport report = check_recipe(recipe, limits());
  CHECK(report.plan.has_value() == report.problems.empty());
  return report.problems;
}

/// Expects exactly one problem, at this place, with `words` in its sentence.
void refused(const std::string& recipe, const std::string& pointer, const std::string& words) {
  const std::vector<Diagnostic> problems = problems_of(recipe);
  for (const Diagnostic& problem : problems) UNSCOPED_INFO(to_string(problem));
  REQUIRE(problems.size() == 1);
  CHECK(problems[0].pointer == pointer);
  CHECK_THAT(to_string(problems[0]), Catch::Contains(words));
}

const std::string phases = "/explorations/M2/phases";

}  // namespace

TEST_CASE("A good recipe becomes a plan in SI units") {
  const Plan plan = test::plan_of(small_recipe);
  CHECK(plan.trials.size() == 4);
  const Exploration& m2 = plan.explorations.at(0);
  CHECK(m2.step(weft::Phase::motion).speed_mps == 0.002);
  CHECK(m2.step(weft::Phase::motion).force_n == 5);
  CHECK(m2.step(weft::Phase::press).force_band_n == 0.25);
  const std::vector<Vec2> corners{{0, 0.05}, {0.05, 0.05}};
  CHECK(m2.step(weft::Phase::motion).path_m == corners);
}

TEST_CASE("A path without a start lies in the middle of the plate") {
  const Plan plan = test::plan_of(small_recipe);
  CHECK(plan.explorations[0].start_m.x_m == Approx(0.05));
  CHECK(plan.explorations[0].start_m.y_m == Approx(0.05));
}

TEST_CASE("An unknown key is refused with a did-you-mean") {
  refused(small_with("\"repetitions\": 2", "\"repetitions\": 2, \"ordr\": {}"), "/ordr",
          "Did you mean order");
  refused(small_with("\"path\"", "\"frce_band_N\": 0.2, \"path\""), phases + "/2/frce_band_N",
          "Did you mean force_band_N");
  refused(small_with("\"repetitions\": 2", "\"repetitions\": 2, \"zebra\": 1"), "/zebra",
          "Known keys");
}

TEST_CASE("repeat_bad of a recipe is read; without it no attempt is judged") {
  CHECK_FALSE(test::plan_of(small_recipe).repeat_bad);
  const std::string reps = "\"repetitions\": 2";
  const Plan plan = test::plan_of(
      small_with(reps, reps + R"(, "repeat_bad": {"at_most": 3, "lost_fraction": 0.05})"));
  REQUIRE(plan.repeat_bad);
  CHECK(most_attempts(plan) == 4);
  CHECK(plan.repeat_bad->lost_fraction == 0.05);
  CHECK(plan.canonical_json != test::plan_of(small_recipe).canonical_json);
  refused(small_with(reps, reps + R"(, "repeat_bad": {"at_most": 3, "lost_fracton": 0})"),
          "/repeat_bad/lost_fracton", "Did you mean lost_fraction");
}

TEST_CASE("A wrong or missing unit is refused with the right spellings") {
  refused(small_with("speed_mm_s", "speed_cm_s"), phases + "/2/speed_cm_s",
          "speed_mm_s or speed_mps");
  refused(small_with("speed_mm_s", "speed"), phases + "/2/speed", "Did you mean speed_mm_s");
  refused(small_with("\"force_N\"", "\"force_kN\""), phases + "/1/force_kN",
          "Did you mean force_N");
  refused(small_with("\"duration_s\": 3", "\"duration_ms\": 3000"), phases + "/0/duration_ms",
          "Did you mean duration_s");
}

TEST_CASE("A zero byte is refused, with any text behind it") {
  refused(std::string(small_recipe) + '\0' + "anything", "", "line 7, column 40 (expected");
  refused(std::string(1, '\0') + small_recipe, "", "line 1, column 1 (expected");
}

TEST_CASE("Two units for one quantity are refused") {
  refused(small_with("\"speed_mm_s\": 2", "\"speed_mm_s\": 2, \"speed_mps\": 0.002"), phases + "/2",
          "(expected speed_mm_s or speed_mps)");
}

TEST_CASE("A missing phase is refused") {
  refused(small_with("{\"phase\": \"S\", \"duration_s\": 3},", ""), phases, "S missing");
  refused(small_with(",\n    {\"phase\": \"E\", \"duration_s\": 2}", ""), phases, "E missing");
}

TEST_CASE("Phases in another order or given twice are refused") {
  std::string swapped = small_with("\"E\", \"duration_s\": 2", "\"S\", \"duration_s\": 2");
  swapped = with(swapped, "\"S\", \"duration_s\": 3", "\"E\", \"duration_s\": 3");
  refused(swapped, phases, "wrong order");
  refused(
      small_with("{\"phase\": \"S\", \"duration_s\": 3},",
                 "{\"phase\": \"S\", \"duration_s\": 3}, {\"phase\": \"S\", \"duration_s\": 3},"),
      phases, "S given");
}

TEST_CASE("Phase M needs a path that leads somewhere") {
  refused(small_with("[{\"dx_mm\": 0, \"dy_mm\": 50}, {\"dx_mm\": 50, \"dy_mm\": 0}]", "[]"),
          phases + "/2/path", "path empty");
  refused(small_with("\"dy_mm\": 50", "\"dy_mm\": 0"), phases + "/2/path/0",
          "(expected at least 0.001 mm)");
  refused(small_with("\"path\"", "\"duration_s\": 5, \"path\""), phases + "/2/duration_s",
          "phase M");
}

TEST_CASE("A speed over the rig's limit, of zero or below is refused") {
  refused(small_with("\"speed_mm_s\": 2", "\"speed_mm_s\": 4.001"), phases + "/2/speed_mm_s",
          ": 4.001 (expected 0.001 to 4.0");
  refused(small_with("\"speed_mm_s\": 2", "\"speed_mm_s\": 0"), phases + "/2/speed_mm_s", ": 0 (");
  refused(small_with("\"speed_mm_s\": 2", "\"speed_mm_s\": -2"), phases + "/2/speed_mm_s",
          ": -2 (");
  CHECK(problems_of(small_with("\"speed_mm_s\": 2", "\"speed_mm_s\": 4")).empty());
}

TEST_CASE("A path outside plate or travel is refused, face included") {
  refused(small_with("\"dy_mm\": 50", "\"dy_mm\": 135"), phases + "/2/path", "too long");
  CHECK(problems_of(small_with("\"dy_mm\": 50", "\"dy_mm\": 134")).empty());
  refused(small_with("{\"phases\"", "{\"start\": {\"x_mm\": 50, \"y_mm\": 93}, \"phases\""),
          phases + "/2/path", "along y: 93.0 mm to 143.0 mm (expected 8.0 mm to 142.0 mm)");
  refused(small_with("{\"phases\"", "{\"start\": {\"x_mm\": 7, \"y_mm\": 50}, \"phases\""),
          phases + "/2/path", "along x");
  RigLimits narrow = limits();
  narrow.geometry.travel[index(Axis::y)].max = 0.055;
  const CheckReport report = check_recipe(small_recipe, narrow);
  REQUIRE(report.problems.size() == 1);
  CHECK_THAT(to_string(report.problems[0]), Catch::Contains("at most 47.0 mm"));
}

TEST_CASE("A force over the cap, within the noise, or that the mount cannot hold is refused") {
  refused(small_with("\"force_N\": 5", "\"force_N\": 10.5"), phases + "/1/force_N",
          ": 10.5 (expected");
  refused(small_with("\"force_N\": 5", "\"force_N\": 9.9"), phases + "/1/force_N",
          "(expected at most 10.0 N)");
  refused(small_with("\"force_N\": 5", "\"force_N\": 0.05"), phases + "/1/force_N", "noise");
  refused(small_with("\"force_N\": 5", "\"force_N\": -1"), phases + "/1/force_N", ": -1 (expected");
  refused(small_with("\"force_N\": 5", "\"force_N\": 0.2, \"force_band_N\": 0.2"),
          phases + "/1/force_band_N", "no contact");
  CHECK(check_recipe(small_with("\"force_N\": 5", "\"force_N\": 0.2"), limits())
            .plan->explorations[0]
            .step(weft::Phase::press)
            .force_band_n == 0.1);
  RigLimits real = limits();
  real.hangs_on_stop = false;  // no stop carries a part of the probe's weight
  for (const char* force : {"0", "1.9"}) {
    const CheckReport report =
        check_recipe(small_with("\"force_N\": 5", std::string("\"force_N\": ") + force), real);
    REQUIRE(report.problems.size() == 1);
    CHECK(report.problems[0].pointer == phases + "/1/force_N");
  }
  refused(small_with("\"speed_mm_s\": 2", "\"speed_mm_s\": 2, \"force_N\": 6"), phases,
          ": 6.0 N in M (expected");
  refused(small_with("\"duration_s\": 3", "\"duration_s\": 3, \"force_N\": 2"),
          phases + "/0/force_N", "phase S");
}

TEST_CASE("Forces from nothing to the cap are planned, and M has that of P") {
  for (const double force_n : {0.0, 0.1, 1.0, 1.9, 2.0, 5.0, 9.75}) {
    CAPTURE(force_n);
    const CheckReport report = check_recipe(
        small_with("\"force_N\": 5", "\"force_N\": " + std::to_string(force_n)), limits());
    REQUIRE(report.plan);
    CHECK(report.plan->explorations[0].step(weft::Phase::press).force_n == force_n);
    CHECK(report.plan->explorations[0].step(weft::Phase::motion).force_n == force_n);
  }
}

TEST_CASE("A slack smaller than the rest travel is refused, in the rig and in the recipe") {
  RigLimits tight = limits();
  tight.slack_m = 0.55e-3;  // the stage runs on by 0.05 mm at 0.5 mm/s
  const CheckReport report = check_recipe(small_recipe, tight);
  REQUIRE(report.problems.size() == 1);
  CHECK(report.problems[0].pointer == "/approach/seat_speed_mm_s");
  tight.slack_m = 0.57e-3;
  CHECK(check_recipe(small_recipe, tight).problems.empty());
  tight.slack_m.reset();
  CHECK(check_recipe(small_recipe, tight).warnings.size() ==
        check_recipe(small_recipe, limits()).warnings.size() + 1);
}

TEST_CASE("Repetition counts that make no campaign are refused") {
  refused(small_with("\"repetitions\": 2", "\"repetitions\": 0"), "/repetitions", ": 0 (");
  refused(small_with("\"repetitions\": 2", "\"repetitions\": -1"), "/repetitions", ": -1 (");
  refused(small_with("\"repetitions\": 2", "\"repetitions\": 2.5"), "/repetitions", "whole number");
  refused(small_with("\"repetitions\": 2", "\"repetitions\": 18446744073709551615"), "/repetitions",
          ": 18446744073709551615 (");
  refused(small_with("\"repetitions\": 2", "\"repetitions\": \"2\""), "/repetitions", "wrong type");
}

TEST_CASE("A campaign of more than a million trials is refused") {
  std::string fabrics = "\"f0\"";
  for (int i = 1; i < 11; ++i) fabrics += ", \"f" + std::to_string(i) + "\"";
  const std::string eleven = small_with("\"denim\", \"silk\"", fabrics);
  refused(with(eleven, "\"repetitions\": 2", "\"repetitions\": 100000"), "", ": 1100000 (");
}

TEST_CASE("NaN and Infinity are refused by name and place") {
  refused(small_with("\"force_N\": 5", "\"force_N\": NaN"), phases + "/1",
          "line 5, column 31: NaN (expected a finite number)");
  refused(small_with("\"force_N\": 5", "\"force_N\": nan"), phases + "/1", ": nan (");
  refused(small_with("\"force_N\": 5", "\"force_N\": -Infinity"), phases + "/1", ": -Infinity (");
  refused(small_with("\"force_N\": 5", "\"force_N\": \"NaN\""), phases + "/1/force_N", "a number");
}

TEST_CASE("A number that no double holds is refused") {
  refused(small_with("\"force_N\": 5", "\"force_N\": 1e999"), phases + "/1", "too large");
  refused(small_with("\"force_N\": 5", "\"force_N\": 1e308"), phases + "/1/force_N", ": 1e+308 (");
  refused(small_with("\"force_N\": 5", "\"force_N\": 4e-320"), phases + "/1/force_N", "noise");
}

TEST_CASE("Durations of zero, below zero or beyond reason are refused") {
  for (const char* bad : {"0", "-1", "1e9"})
    refused(small_with("\"duration_s\": 3", std::string("\"duration_s\": ") + bad),
            phases + "/0/duration_s",
            std::string(": ") + (bad[0] == '1' ? "1000000000.0" : bad) + " (");
}

TEST_CASE("Fabrics must be there, named, listed once and known to the rig") {
  refused(small_with("[\"denim\", \"silk\"]", "[]"), "/fabrics", "empty: 0 (");
  refused(small_with("\"silk\"", "\"denim\""), "/fabrics/1", "listed twice");
  refused(small_with("\"silk\"", "\"../silk\""), "/fabrics/1", ": \"../silk\" (");
  RigLimits known = limits();
  known.fabrics = {"denim", "silk"};
  const CheckReport report = check_recipe(small_with("\"silk\"", "\"slik\""), known);
  REQUIRE(report.problems.size() == 1);
  CHECK_THAT(to_string(report.problems[0]), Catch::Contains("Did you mean silk"));
}

TEST_CASE("A syntax error comes with line and column") {
  refused("{\n  \"name\": \"x\",,\n}", "", "line 2, column 15");
  refused("", "", "line 1, column 1");
  refused("{\"name\": \"x\"} trailing", "", "line 1, column 15");
  refused("{\"name\": \"\xff\xfe\"}", "", "JSON at line 1");
}

TEST_CASE("A document that is not an object is refused") {
  for (const char* text : {"[]", "null", "3", "\"text\""}) refused(text, "", "expected an object");
}

TEST_CASE("A key given twice is refused") {
  refused(small_with("\"repetitions\": 2", "\"repetitions\": 2, \"repetitions\": 3"),
          "/repetitions", "given twice");
}

TEST_CASE("A recipe of 200 MB is refused by its size") {
  const std::string huge(200'000'000, ' ');
  refused(huge, "", ": 200000000 bytes (expected at most 1048576 bytes)");
}

TEST_CASE("Deep nesting is refused, not followed") {
  const std::string deep = std::string(100'000, '[') + std::string(100'000, ']');
  refused(deep, std::string("/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0"),
          "too deeply");
}

TEST_CASE("All problems are reported at once") {
  std::string recipe = small_with("\"speed_mm_s\": 2", "\"speed_mm_s\": 9");
  recipe = with(recipe, "\"repetitions\": 2", "\"repetitions\": 0, \"colour\": 1");
  recipe = with(recipe, "\"silk\"", "7");
  recipe = with(recipe, "{\"phase\": \"E\", \"duration_s\": 2}", "{\"phase\": \"E\"}");
  std::vector<std::string> pointers;
  for (const Diagnostic& problem : problems_of(recipe)) pointers.push_back(problem.pointer);
  CHECK_THAT(pointers, Catch::UnorderedEquals(std::vector<std::string>{"/repetitions", "/fabrics/1",
                                                                       phases + "/2/speed_mm_s",
                                                                       phases + "/3", "/colour"}));
}

TEST_CASE("A flood of problems is cut to a number that can be read") {
  std::string recipe = "{";
  for (int i = 0; i < 5000; ++i) recipe += "\"k" + std::to_string(i) + "\": 0, ";
  const auto problems = problems_of(recipe + "\"schema_version\": 1}");
  CHECK(problems.size() == 201);
  CHECK_THAT(problems.back().message, Catch::Contains("more problems"));
}

TEST_CASE("Any prefix of a recipe is refused without harm") {
  const std::string whole = small_recipe;
  for (std::size_t n = 0; n < whole.size(); ++n) {
    const auto problems = problems_of(whole.substr(0, n));
    if (problems.size() != 1) FAIL("prefix of " << n << " bytes");
  }
}

TEST_CASE("Any single damaged byte gives a plan or a problem") {
  const std::string whole = small_recipe;
  for (std::size_t i = 0; i < whole.size(); ++i)
    for (const char c : {'"', '{', '9', '\0', '\x80'}) {
      std::string damaged = whole;
      damaged[i] = c;
      const CheckReport report = check_recipe(damaged, limits());
      if (report.plan.has_value() != report.problems.empty()) FAIL("byte " << i);
    }
}

}  // namespace check_test
