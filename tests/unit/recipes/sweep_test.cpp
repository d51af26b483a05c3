// Sweeps: refusals, the cells and their order, the normal form.

#include "recipes/engine/sweep.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "tests/unit/recipes/bench.hpp"

namespace sweep_test {

using namespace weft::recipes;
using nlohmann::json;
using test::small_with;

namespace {

const std::string reps = "\"repetitions\": 2";
const std::string force = R"({"name": "force_N", "values": [2, 5]})";
const std::string speed = R"({"name": "speed_mm_s", "values": [0.5, 2, 4]})";

std::string with_sweep(const std::string& factors, const std::string& more = "") {
  return small_with(reps,
                    R"("sweep": {"replicates": 3, "factors": [)" + factors + "]" + more + "}");
}

/// The problems at `pointer`, as sentences.
std::string problem_at(const std::string& recipe, const std::string& pointer) {
  const CheckReport report = check_recipe(recipe, test::limits());
  CHECK_FALSE(report.plan);
  std::string all, found;
  for (const Diagnostic& problem : report.problems) {
    all += to_string(problem) + "\n";
    if (problem.pointer == pointer) found += to_string(problem);
  }
  INFO(all);
  CHECK_FALSE(found.empty());
  return found;
}

std::string normal(const std::string& recipe) {
  return test::plan_of(recipe).canonical_json;
}

std::string numbers(int count) {
  std::string out;
  for (int i = 0; i < count; ++i) out += (i == 0 ? "" : ", ") + std::to_string(2 + 1e-3 * i);
  return out;
}

}  // namespace

TEST_CASE("A factor outside the rig's limits is refused with a sentence") {
  CHECK_THAT(problem_at(with_sweep(R"({"name": "force_N", "values": [5, 12]})"),
                        "/sweep/factors/0/values/1"),
             Catch::Contains(": 12 (expected 0.1 to 10.0, "));
  // the band counts
  CHECK_THAT(problem_at(with_sweep(R"({"name": "force_N", "values": [9.9]})"),
                        "/sweep/factors/0/values/0"),
             Catch::Contains(" N (expected at most 10.0 N)"));
  CHECK_THAT(problem_at(with_sweep(R"({"name": "speed_mps", "values": [0.005]})"),
                        "/sweep/factors/0/values/0"),
             Catch::Contains(": 0.005 (expected 1e-06 to 0.004, "));
  // 2 + 2 legs of a quarter of it each; it no longer fits, and is reported once
  CHECK_THAT(problem_at(with_sweep(R"({"name": "stroke_mm", "values": [100, 400]}, )" + speed),
                        "/sweep/factors/0/values/1"),
             Catch::Contains("along x") && Catch::Contains("along y"));
}

TEST_CASE("A factor without a value, and a sweep without a factor, are refused with a sentence") {
  CHECK_THAT(
      problem_at(with_sweep(R"({"name": "force_N", "values": []})"), "/sweep/factors/0/values"),
      Catch::Contains(": 0 (expected at least one)"));
  CHECK_THAT(problem_at(with_sweep(""), "/sweep/factors"),
             Catch::Contains(": 0 (expected at least one)"));
}

TEST_CASE("A sweep of more than a million trials is refused with a sentence") {
  const std::string many = R"({"name": "force_N", "values": [)" + numbers(400) +
                           R"(]}, {"name": "press_s", "values": [)" + numbers(500) + "]}";
  CHECK_THAT(problem_at(with_sweep(many), "/sweep"),
             Catch::Contains(": 1200000.0 (expected at most 1000000)"));
  // 400 x 30 x 2 fabrics x 3 replicates are fewer trials, but not a pilot study
  const std::string wide = R"({"name": "force_N", "values": [)" + numbers(400) +
                           R"(]}, {"name": "press_s", "values": [)" + numbers(30) + "]}";
  CHECK_THAT(problem_at(with_sweep(wide), "/sweep"), Catch::Contains(": 12000 (expected at most "));
}

TEST_CASE("Two factors of one name are refused with a sentence, however they are spelled") {
  CHECK_THAT(problem_at(with_sweep(force + ", " + force), "/sweep/factors/1/name"),
             Catch::Contains("given twice") && Catch::Contains(": force_N ("));
  CHECK_THAT(problem_at(with_sweep(force + R"(, {"name": "force_n", "values": [3]})"),
                        "/sweep/factors/1/name"),
             Catch::Contains("given twice"));
  const CheckReport twice = check_recipe(
      with_sweep(R"({"name": "force_N", "values": [2], "values": [5]})"), test::limits());
  REQUIRE(twice.problems.size() == 1);
  CHECK_THAT(to_string(twice.problems[0]), Catch::Contains("values"));
}

TEST_CASE("All other problems of a sweep are reported at once") {
  CHECK_THAT(
      problem_at(with_sweep(R"({"name": "forse_N", "values": [5]})"), "/sweep/factors/0/name"),
      Catch::Contains("Did you mean force_N"));
  CHECK_THAT(
      problem_at(with_sweep(R"({"name": "colour", "values": [5]})"), "/sweep/factors/0/name"),
      Catch::Contains("Known factors"));
  CHECK_THAT(problem_at(with_sweep(R"({"name": "force_N", "values": [5, 3, 5.0]})"),
                        "/sweep/factors/0/values/2"),
             Catch::Contains("listed twice"));
  CHECK_THAT(problem_at(with_sweep(force, R"(, "design": "half")"), "/sweep/design"),
             Catch::Contains(": \"half\" (expected \"full\""));
  CHECK_THAT(problem_at(with_sweep(force + ", " + speed, R"(, "design": {"cell_fraction": 0.5})"),
                        "/sweep/design/cell_fraction"),
             Catch::Contains(": 3 of 6 (expected at least 5 cells)"));
  CHECK_THAT(problem_at(with_sweep(force, R"(, "order": "as_listed", "seed": 3)"), "/sweep/seed"),
             Catch::Contains("listed"));
  const std::string beside = with_sweep(force).replace(
      1, 0, reps + R"(, "order": {"kind": "blocked"}, "hand_over": {}, )");
  for (const char* pointer : {"/repetitions", "/order", "/hand_over"}) problem_at(beside, pointer);
  const CheckReport both = check_recipe(
      with_sweep(R"({"name": "force_N", "values": [99, "x"]}, {"name": "speed"})"), test::limits());
  CHECK(both.problems.size() == 4);
}

TEST_CASE("A sweep is bounded in values, factors and explorations, each with a sentence") {
  const std::string long_list = R"({"name": "press_s", "values": [)" + numbers(10'001) + "]}";
  CHECK_THAT(problem_at(with_sweep(long_list), "/sweep/factors/0/values"),
             Catch::Contains(": 10001 (expected at most 10000)"));
  std::string factors = force;
  for (int i = 0; i < 5; ++i) factors += ", " + force;
  CHECK_THAT(problem_at(with_sweep(factors), "/sweep/factors"),
             Catch::Contains(": 6 (expected at most 5, "));
  // 16 x 700 explorations of 2 trials are fewer than a million trials, and each exploration has
  // fewer than 10 000 cells
  std::string many = with_sweep(R"({"name": "press_s", "values": [)" + numbers(700) + "]}");
  many = test::with(many, "\"replicates\": 3", "\"replicates\": 1");
  const std::size_t at = many.find("\"M2\"");
  const std::string phases = many.substr(at + 5, many.rfind("}}") - at - 5);
  for (int i = 0; i < 15; ++i) many.insert(at, "\"N" + std::to_string(i) + "\": " + phases + ",");
  CHECK_THAT(problem_at(many, "/sweep"),
             Catch::Contains(": 16 explorations in 700 cells: 11200 (expected at most 10000)"));
}

TEST_CASE("The longest name of a cell counts, not the last one") {
  const std::string longest(57, 'x');  // with "-2.125N" it has 64 characters, with "-2.0625N" 65
  const auto named = [&](const std::string& values) {
    return test::with(with_sweep(R"({"name": "force_N", "values": [)" + values + "]}"), "\"M2\"",
                      "\"" + longest + "\"");
  };
  CHECK(check_recipe(named("2.125, 2"), test::limits()).plan);
  CHECK_THAT(problem_at(named("2.0625, 2"), "/explorations/" + longest),
             Catch::Contains("-2.0625N (expected at most 64 bytes"));
}

TEST_CASE("A stroke that makes a leg of its path vanish is refused with a sentence") {
  const std::string uneven =
      test::with(with_sweep(R"({"name": "stroke_mm", "values": [50, 2]})"),
                 R"({"dx_mm": 50, "dy_mm": 0})", R"({"dx_mm": 0.01, "dy_mm": 0})");
  CHECK_THAT(problem_at(uneven, "/sweep/factors/0/values/1"),
             Catch::Contains("too short") && Catch::Contains("at least 0.001 mm"));
}

TEST_CASE("The checker warns of cells that weft design analyse leaves out") {
  const auto warnings = [](const std::string& recipe, double rate_hz = 37) {
    RigLimits limits = test::limits();
    limits.taxel_rate_hz = rate_hz;
    const CheckReport report = check_recipe(recipe, limits);
    REQUIRE(report.plan);
    std::string out;
    for (const Diagnostic& one : report.warnings) out += to_string(one) + "\n";
    return out;
  };
  const std::string good = with_sweep(force + ", " + speed);
  CHECK_THAT(warnings(good), !Catch::Contains("design analyse"));
  CHECK_THAT(warnings(test::with(good, "\"replicates\": 3", "\"replicates\": 2")),
             Catch::Contains("/sweep/replicates: too few") &&
                 Catch::Contains(": 2 (expected at least 3)"));
  CHECK_THAT(warnings(test::with(good, R"(["denim", "silk"])", R"(["denim"])")),
             Catch::Contains("/fabrics: too few") && Catch::Contains(": 1 (expected at least 2)"));
  // two legs of 0.05 mm at 20 mm/s2: 0.1 s each, sampled at 20 Hz
  CHECK_THAT(warnings(with_sweep(R"({"name": "stroke_mm", "values": [100, 0.1]})"), 20),
             Catch::Contains("/explorations/M2: too few") && Catch::Contains("phase M") &&
                 Catch::Contains("in M2-0.1mm") && !Catch::Contains("phase P"));
  CHECK_THAT(warnings(with_sweep(R"({"name": "press_s", "values": [6, 0.1]})"), 20),
             Catch::Contains("phase P") && Catch::Contains("(expected at least 3 in every cell"));
  std::string press = with_sweep(force);
  press = test::with(press, R"({"phases": [)", R"({"kind": "press", "phases": [)");
  const std::size_t motion = press.find(R"({"phase": "M")");
  press.erase(motion, press.find(R"({"phase": "E")") - motion);
  CHECK_THAT(warnings(press), Catch::Contains("/explorations/M2: press without"));
}

TEST_CASE("Every exploration is done in every cell, with the cell's values in its phases") {
  const Plan plan = test::plan_of(with_sweep(force + ", " + speed));
  REQUIRE(plan.sweep);
  CHECK(plan.sweep->cells.size() == 6);
  CHECK(plan.explorations.size() == 6);
  CHECK(plan.trials.size() == 2 * 6 * 3);
  const Exploration& last = plan.explorations.back();
  CHECK(last.name == "M2-5N-4mm_s");
  CHECK(last.factors == std::vector<double>{5, 0.004});
  CHECK(last.step(weft::Phase::motion).force_n == 5);
  CHECK(last.step(weft::Phase::motion).speed_mps == 0.004);
  CHECK(plan.explorations.front().name == "M2-2N-0.5mm_s");
  CHECK(plan.forecast.mounts == 2);
  // the slow cell lasts longer than the fast one
  CHECK(plan.explorations[0].step(weft::Phase::motion).duration_s >
        plan.explorations[2].step(weft::Phase::motion).duration_s);
  CHECK(plan.forecast.force_n->max == 5);
  std::set<std::string> names;
  for (const Exploration& e : plan.explorations) names.insert(e.name);
  CHECK(names.size() == plan.explorations.size());
}

TEST_CASE("A stroke keeps its shape, and the time of P its place") {
  const Plan plan = test::plan_of(with_sweep(
      R"({"name": "stroke_mm", "values": [20, 100]}, {"name": "press_s", "values": [1.5]})"));
  const Exploration& small = plan.explorations[0];
  CHECK(small.name == "M2-20mm-1.5s");
  CHECK(small.step(weft::Phase::press).duration_s == 1.5);
  CHECK(small.path_m()[0].y_m == Approx(0.010));
  CHECK(small.path_m()[1].x_m == Approx(0.010));
  // centred again: half of 150 mm minus half of 10 mm
  CHECK(small.start_m.x_m == Approx(0.070));
  CHECK(plan.explorations[1].start_m.x_m == Approx(0.050));
}

TEST_CASE("A direction turns the path about its start, from x towards y") {
  const Plan plan = test::plan_of(with_sweep(
      R"({"name": "direction_deg", "values": [0, 45, 90, -90, 180]}, {"name": "press_s", "values": [1.5]})"));
  const auto corners = [&](std::size_t cell) {
    std::vector<double> out;
    for (const Vec2& corner : plan.explorations[cell].path_m()) {
      out.push_back(corner.x_m);
      out.push_back(corner.y_m);
    }
    return out;
  };
  // as written: 50 mm along y, then 50 mm along x
  CHECK(corners(0) == std::vector<double>{0, 0.05, 0.05, 0.05});
  // exact at quarter turns, so that no stage gets a move of nothing
  CHECK(corners(2) == std::vector<double>{-0.05, 0, -0.05, 0.05});
  CHECK(corners(3) == std::vector<double>{0.05, 0, 0.05, -0.05});
  CHECK(corners(4) == std::vector<double>{0, -0.05, -0.05, -0.05});
  const double half_root = 0.05 / std::sqrt(2);
  CHECK(corners(1)[0] == Approx(-half_root));
  CHECK(corners(1)[1] == Approx(half_root));
  CHECK(corners(1)[2] == Approx(0).margin(1e-15));
  CHECK(corners(1)[3] == Approx(2 * half_root));
  CHECK(plan.explorations[1].name == "M2-45deg-1.5s");
  CHECK(plan.explorations[3].name == "M2-270deg-1.5s");
  CHECK(plan.explorations[3].factors[0] == Approx(1.5 * std::numbers::pi));
  CHECK(plan.explorations[4].factors[0] == Approx(std::numbers::pi));
  // each is centred again: the L as written reaches 50 mm to both positive sides
  CHECK(plan.explorations[0].start_m.x_m == Approx(0.050));
  CHECK(plan.explorations[0].start_m.y_m == Approx(0.050));
  CHECK(plan.explorations[4].start_m.x_m == Approx(0.100));
  CHECK(plan.explorations[4].start_m.y_m == Approx(0.100));
  // the turn changes neither the length nor, along one axis, the time
  CHECK(plan.explorations[2].step(weft::Phase::motion).duration_s ==
        Approx(plan.explorations[0].step(weft::Phase::motion).duration_s));
  CHECK_THAT(sweep_text(*plan.sweep), Catch::Contains("direction 0, 45, 90, 270, 180 deg x press"));
}

TEST_CASE("A direction and a stroke turn and scale the same path") {
  const Plan plan =
      test::plan_of(with_sweep(R"({"name": "direction_rad", "values": [1.5707963267948966]}, )"
                               R"({"name": "stroke_mm", "values": [40]})"));
  const std::vector<Vec2>& path = plan.explorations.front().path_m();
  CHECK(path[0].x_m == Approx(-0.020));
  CHECK(path[0].y_m == Approx(0).margin(1e-15));
  CHECK(path[1].y_m == Approx(0.020));
  CHECK(plan.explorations.front().name == "M2-90deg-40mm");
}

TEST_CASE("Directions that cannot be are refused with a sentence") {
  const auto direction = [](const std::string& values) {
    return with_sweep(R"({"name": "direction_deg", "values": [)" + values + "]}");
  };
  const std::string third = "/sweep/factors/0/values/2";
  CHECK_THAT(problem_at(direction("0, 90, 360"), third),
             Catch::Contains("direction listed twice: 360 (expected every direction once, modulo"));
  CHECK_THAT(problem_at(direction("0, 270, -90"), third), Catch::Contains("listed twice: -90"));
  CHECK_THAT(problem_at(direction("0, 90, 359.9999999"), third), Catch::Contains("listed twice"));
  CHECK_THAT(problem_at(direction("0, 90, -0.0"), third), Catch::Contains("listed twice: -0.0"));
  CHECK_THAT(problem_at(direction("0, 90, 361"), third),
             Catch::Contains("out of range: 361 (expected -360"));
  CHECK_THAT(
      problem_at(test::with(direction("0, 90"), "]}]", "]}], \"design\": {\"cell_fraction\": 0.5}"),
                 "/sweep/design"),
      Catch::Contains("directions, which are periodic"));
  // every cell is checked against plate and travel: 100 mm along y fit, 100 mm along x do not
  RigLimits narrow = test::limits();
  narrow.geometry.travel[index(Axis::x)] = {0, 0.08};
  const CheckReport report =
      check_recipe(test::with(direction("0, 90"), R"({"dx_mm": 50, "dy_mm": 0})",
                              R"({"dx_mm": 0, "dy_mm": 50})"),
                   narrow);
  REQUIRE(report.problems.size() == 1);
  CHECK(report.problems[0].pointer == "/sweep/factors/0/values/1");
  CHECK_THAT(to_string(report.problems[0]), Catch::Contains("path too long along x"));
  std::string press =
      test::with(direction("0, 90"), R"({"phases": [)", R"({"kind": "press", "phases": [)");
  const std::size_t motion = press.find(R"({"phase": "M")");
  press.erase(motion, press.find(R"({"phase": "E")") - motion);
  CHECK_THAT(problem_at(press, "/sweep/factors/0/name"),
             Catch::Contains("direction_deg not allowed with a press"));
}

TEST_CASE("The normal form of directions has the path as written, and one spelling") {
  const auto recipe = [](const std::string& factor) { return normal(with_sweep(factor)); };
  const json document = json::parse(recipe(R"({"name": "direction_deg", "values": [90, -90]})"));
  CHECK(document["sweep"]["factors"][0]["name"] == "direction_rad");
  const json& exploration = document["explorations"]["M2"];
  CHECK(exploration["phases"][2]["corners"][0] == json{{"x_m", 0.0}, {"y_m", 0.05}});
  CHECK_FALSE(exploration.contains("start"));
  CHECK(recipe(R"({"name": "direction_deg", "values": [90, 270]})") ==
        recipe(R"({"name": "direction_deg", "values": [90, -90]})"));
}

TEST_CASE("A sweep blocked by fabric mounts each once, and each replicate is a complete block") {
  const Plan plan = test::plan_of(with_sweep(force + ", " + speed));
  std::vector<std::set<std::size_t>> blocks(6);
  std::set<std::vector<std::size_t>> orders;
  for (std::size_t b = 0; b < 6; ++b) {
    std::vector<std::size_t> order;
    for (std::size_t i = 6 * b; i < 6 * b + 6; ++i) {
      CHECK(plan.trials[i].fabric == b / 3);
      CHECK(plan.trials[i].repetition == b % 3 + 1);
      blocks[b].insert(plan.trials[i].exploration);
      order.push_back(plan.trials[i].exploration);
    }
    CHECK(blocks[b].size() == 6);
    orders.insert(order);
  }
  CHECK(orders.size() > 1);  // drawn again for each
}

TEST_CASE("Blocked by replicate every cloth is mounted anew; not blocked, all trials mix") {
  const Plan by = test::plan_of(with_sweep(force + ", " + speed, R"(, "block_by": "replicate")"));
  for (std::size_t i = 0; i < by.trials.size(); ++i) CHECK(by.trials[i].repetition == i / 12 + 1);
  CHECK(by.forecast.mounts <= 6);
  const Plan none = test::plan_of(with_sweep(force + ", " + speed, R"(, "block_by": "none")"));
  CHECK(none.forecast.mounts > 6);
  std::map<std::pair<std::size_t, std::size_t>, std::set<std::uint32_t>> done;
  for (const TrialSpec& t : none.trials) done[{t.fabric, t.exploration}].insert(t.repetition);
  CHECK(done.size() == 12);
  for (const auto& [cell, replicates] : done) CHECK(replicates == std::set<std::uint32_t>{1, 2, 3});
}

TEST_CASE("The order follows from the seed, the patches of cloth do not follow from the order") {
  const Plan one = test::plan_of(with_sweep(force + ", " + speed, R"(, "seed": 5)"));
  const Plan same = test::plan_of(with_sweep(force + ", " + speed, R"(, "seed": 5)"));
  const Plan other = test::plan_of(with_sweep(force + ", " + speed, R"(, "seed": 6)"));
  const Plan listed = test::plan_of(with_sweep(force + ", " + speed, R"(, "order": "as_listed")"));
  const auto order = [](const Plan& plan) {
    std::vector<std::size_t> out;
    for (const TrialSpec& t : plan.trials) out.push_back(t.exploration);
    return out;
  };
  const auto patches = [](const Plan& plan) {
    std::set<std::uint64_t> out;
    for (const TrialSpec& t : plan.trials) out.insert(t.seeds.touch);
    return out;
  };
  CHECK(order(one) == order(same));
  CHECK(order(one) != order(other));
  CHECK(order(listed)[1] == 1);
  CHECK(patches(one) == patches(other));
  CHECK(patches(one) == patches(listed));
  CHECK(patches(one).size() == one.trials.size());
}

TEST_CASE("The normal form has the sweep, not what it replaces") {
  const std::string recipe = with_sweep(force + ", " + speed);
  const json document = json::parse(normal(recipe));
  CHECK(document["sweep"]["factors"][1] ==
        json{{"name", "speed_mps"}, {"values", {0.0005, 0.002, 0.004}}});
  CHECK_FALSE(document.contains("repetitions"));
  CHECK(document["explorations"].size() == 1);
  // another notation is the same campaign, and so is another value in the phases
  CHECK(
      normal(with_sweep(force + R"(, {"name": "speed_mps", "values": [0.0005, 0.002, 0.004]})")) ==
      normal(recipe));
  CHECK(normal(test::with(recipe, "\"force_N\": 5,", "\"force_N\": 3,")) == normal(recipe));
  CHECK(normal(test::with(recipe, "\"replicates\": 3", "\"replicates\": 4")) != normal(recipe));
  CHECK(normal(with_sweep(force + ", " + speed, R"(, "block_by": "none")")) != normal(recipe));
  CHECK_THAT(sweep_text(*test::plan_of(recipe).sweep),
             Catch::Contains("force 2, 5 N x speed 0.5, 2, 4 mm/s: all 6 cells, 3 replicates"));
}

}  // namespace sweep_test
