#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <set>

#include "recipes/engine/plan.hpp"
#include "tests/unit/recipes/bench.hpp"

namespace plan_test {

using namespace weft::recipes;
using test::limits;
using test::plan_of;
using test::small_recipe;
using test::small_with;
using test::with;

namespace {

const char* const order_stub = "\"repetitions\": 2";

std::string randomised(int seed) {
  std::string text = R"("repetitions": 2, "order": {"kind": "randomised", "seed": )";
  text += std::to_string(seed);
  return small_with(order_stub, text += '}');
}

/// Fabric, repetition and patch of each trial, in order.
std::vector<std::string> sequence(const Plan& plan) {
  std::vector<std::string> out;
  for (const TrialSpec& t : plan.trials)
    out.push_back(plan.fabrics[t.fabric] + std::to_string(t.repetition) + ":" +
                  std::to_string(t.seeds.touch));
  return out;
}

}  // namespace

TEST_CASE("The paper's campaign has 680 experiments") {
  const Plan plan = plan_of(test::source_file("recipes/library/khan2016.json"));
  CHECK(plan.fabrics.size() == 17);
  CHECK(plan.trials.size() == 680);
  for (const Exploration& e : plan.explorations) {
    CHECK(e.step(weft::Phase::press).force_n == 5);
    CHECK(e.step(weft::Phase::motion).speed_mps == 0.002);
  }
  std::set<std::uint64_t> patches;
  for (const TrialSpec& trial : plan.trials) patches.insert(trial.seeds.touch);
  CHECK(patches.size() == 680);
}

TEST_CASE("The largest published campaign is one plan of 18 880 trials, blocked by texture") {
  const auto limits = parse_rig_limits(test::source_file("sim/rigs/textures118.json"));
  REQUIRE(limits.has_value());
  const CheckReport report =
      check_recipe(test::source_file("recipes/library/textures118.json"), *limits);
  REQUIRE(report.plan);
  CHECK(report.warnings.empty());
  const Plan& plan = *report.plan;
  CHECK(plan.fabrics.size() == 118);
  CHECK(plan.fabrics == limits->fabrics);
  CHECK(plan.explorations.size() == 5 * 8);
  REQUIRE(plan.trials.size() == 18'880);
  CHECK(plan.forecast.mounts == 118);
  for (const TrialSpec& trial : plan.trials) CHECK(trial.fabric == trial.index / 160);
  for (const Exploration& e : plan.explorations) {
    CAPTURE(e.name);
    const PhaseStep& slide = e.step(weft::Phase::motion);
    const Vec2 end = slide.path_m.back();
    CHECK(std::hypot(end.x_m, end.y_m) == Approx(0.04).epsilon(1e-12));
    // the stroke is in the middle of the plate, whatever its direction
    CHECK(e.start_m.x_m + end.x_m / 2 == Approx(0.05));
    CHECK(e.start_m.y_m + end.y_m / 2 == Approx(0.05));
    // each axis reaches its share of the speed and holds it for most of the stroke
    const double held_s =
        (0.04 - slide.speed_mps * slide.speed_mps / limits->max_acceleration_mps2) /
        slide.speed_mps;
    CHECK(held_s > 0.54);
    CHECK(slide.duration_s > held_s);
  }
}

TEST_CASE("The library's recipes of one exploration hold half of the campaign each") {
  for (const char* name : {"m1", "m2", "m3-diagonal"}) {
    const Plan plan = plan_of(test::source_file("recipes/library/" + std::string(name) + ".json"));
    CHECK(plan.trials.size() == 340);
  }
  const Plan m1 = plan_of(test::source_file("recipes/library/m1.json"));
  const std::vector<Vec2> along_weft{{0, 0.05}};
  CHECK(m1.explorations[0].step(weft::Phase::motion).path_m == along_weft);
}

TEST_CASE("The diagonal differs from M1 in its direction only") {
  const Plan m1 = plan_of(test::source_file("recipes/library/m1.json"));
  const Plan m3 = plan_of(test::source_file("recipes/library/m3-diagonal.json"));
  REQUIRE(m3.explorations.size() == 1);
  const PhaseStep& slide = m3.explorations[0].step(weft::Phase::motion);
  REQUIRE(slide.path_m.size() == 1);
  const Vec2 end = slide.path_m[0];
  CHECK(end.x_m == end.y_m);  // 45 degrees: warp along x, weft along y
  CHECK(std::hypot(end.x_m, end.y_m) == Approx(0.05).epsilon(1e-12));
  for (const weft::Phase phase :
       {weft::Phase::rest, weft::Phase::press, weft::Phase::motion, weft::Phase::end}) {
    const PhaseStep& ours = m3.explorations[0].step(phase);
    const PhaseStep& theirs = m1.explorations[0].step(phase);
    CHECK(ours.duration_s == Approx(theirs.duration_s));
    CHECK(ours.force_n == theirs.force_n);
    CHECK(ours.force_band_n == theirs.force_band_n);
    CHECK(ours.speed_mps == theirs.speed_mps);
  }
  CHECK(m3.fabrics == m1.fabrics);
  CHECK(m3.trials.size() == m1.trials.size());
}

TEST_CASE("A blocked order finishes one fabric before the next") {
  const Plan plan = plan_of(test::source_file("recipes/library/khan2016.json"));
  for (std::size_t i = 0; i < plan.trials.size(); ++i) {
    REQUIRE(plan.trials[i].index == i);
    REQUIRE(plan.trials[i].fabric == i / 40);
    REQUIRE(plan.trials[i].exploration == i / 20 % 2);
    REQUIRE(plan.trials[i].repetition == i % 20 + 1);
  }
}

TEST_CASE("A seed given in the recipe's place draws what the recipe would draw with it") {
  const std::string stated = with(randomised(5), ", \"seed\": 5", "");
  const auto with_seed = [&](std::uint64_t seed) {
    return check_recipe(stated, limits(), seed).plan.value();
  };
  const std::string written = with(stated, "\"repetitions\"", "\"seed\": 77, \"repetitions\"");
  CHECK(with_seed(77).seed == 77);
  CHECK(sequence(with_seed(77)) == sequence(plan_of(written)));
  CHECK(with_seed(77).canonical_json == plan_of(written).canonical_json);
  CHECK(sequence(with_seed(78)) != sequence(with_seed(77)));
}

TEST_CASE("A seed given in the recipe's place does not hide what is wrong with the text") {
  const std::string twice =
      small_with("\"repetitions\": 2", "\"seed\": 1, \"seed\": 2, \"repetitions\": 2");
  CHECK_FALSE(check_recipe(twice, limits(), 77).plan);
  const std::string wrong = small_with("\"repetitions\": 2", "\"seed\": -1, \"repetitions\": 2");
  CHECK_FALSE(check_recipe(wrong, limits(), 77).plan);
  const CheckReport large = check_recipe(small_recipe, limits(), std::uint64_t{1} << 53);
  REQUIRE(large.problems.size() == 1);
  CHECK(large.problems[0].pointer == "/seed");
}

TEST_CASE("A randomised order holds the same trials, and its seed decides it") {
  const auto blocked = sequence(plan_of(small_recipe));
  const auto one = sequence(plan_of(randomised(1)));
  CHECK_THAT(one, Catch::UnorderedEquals(blocked));
  CHECK(one == sequence(plan_of(randomised(1))));
  bool differs = false;
  for (int seed = 2; seed < 10; ++seed)
    differs = differs || sequence(plan_of(randomised(seed))) != one;
  CHECK(differs);
}

TEST_CASE("Every order of three is about equally frequent") {
  const std::string three = with(with(randomised(0), "\"repetitions\": 2", "\"repetitions\": 1"),
                                 "\"denim\", \"silk\"", "\"a\", \"b\", \"c\"");
  std::map<std::vector<std::string>, int> counts;
  for (int seed = 0; seed < 1200; ++seed)
    ++counts[sequence(plan_of(with(three, "\"seed\": 0", "\"seed\": " + std::to_string(seed))))];
  CHECK(counts.size() == 6);
  for (const auto& [order, count] : counts) CHECK(std::abs(count - 200) < 60);  // 4.6 sigma
}

TEST_CASE("A patch depends on seed, fabric, exploration and repetition, and on nothing else") {
  // FNV-1a 64 of "1/denim/M2/1", then splitmix64, computed with Python.
  CHECK(patch_seed(1, "denim", "M2", 1) == 0x75a332c5ac145837);
  CHECK(patch_seed(1, "denim", "M2", 1) != patch_seed(1, "denim", "M2", 2));
  CHECK(patch_seed(1, "denim", "M2", 1) != patch_seed(2, "denim", "M2", 1));
  CHECK(patch_seed(1, "denim", "M2", 11) != patch_seed(1, "denim", "M21", 1));
}

TEST_CASE("Moves take the time of their trapezoid, or of their triangle when short") {
  CHECK(move_duration_s(0.05, 0.002, 0.02) == Approx(25.1));
  CHECK(move_duration_s(0.0002, 0.002, 0.02) == Approx(0.2));   // just reaches its speed
  CHECK(move_duration_s(0.00005, 0.002, 0.02) == Approx(0.1));  // triangle: 2 sqrt(s / a)
  CHECK(move_duration_s(-0.05, 0.002, 0.02) == Approx(25.1));
  CHECK(move_duration_s(0, 0.002, 0.02) == 0);
}

TEST_CASE("The forecast's envelope is the path's and the margins follow from the travel") {
  const Forecast f = plan_of(small_recipe).forecast;
  const Range& x = f.envelope[index(Axis::x)];
  const Range& z = f.envelope[index(Axis::z)];
  CHECK(x.min == Approx(0.05));
  CHECK(x.max == Approx(0.1));
  CHECK(z.min == Approx(0.092));
  CHECK(z.max == Approx(0.101));
  CHECK(f.margin[index(Axis::x)] == Approx(0.05));
  CHECK(f.margin[index(Axis::z)] == Approx(0.049));
  CHECK(f.force_n->min == Approx(0.2 * 9.80665));
  CHECK(f.force_n->max == 5);
}

TEST_CASE("The forecast has no time to reach a band that has the weight of the probe in it") {
  const auto duration_s = [](double weight_n) {
    RigLimits limits = test::limits();
    limits.probe_weight_n = weight_n;
    return check_recipe(small_recipe, limits).plan->forecast.duration_s;  // 5 N, 0.25 N band
  };
  CHECK(duration_s(1.96) - duration_s(4.8) == Approx(4 * 0.8));
  CHECK(duration_s(4.7) == Approx(duration_s(1.96)));
}

TEST_CASE("The forecast grows with what a trial adds") {
  const Plan plan = plan_of(small_recipe);
  const double per_trial_s = plan.forecast.duration_s / 4;
  CHECK(per_trial_s > 3 + 6 + 2 * 25.1 + 2);
  CHECK(per_trial_s < 3 + 6 + 2 * 25.1 + 2 + 30);
  const Plan longer = plan_of(small_with("\"duration_s\": 6", "\"duration_s\": 16"));
  CHECK(longer.forecast.duration_s - plan.forecast.duration_s == Approx(40));
  CHECK(longer.forecast.bytes > plan.forecast.bytes);
}

TEST_CASE("Texts that plan the same campaign have the same normal form") {
  const std::string normal = plan_of(small_recipe).canonical_json;
  CHECK(plan_of(small_with("\"speed_mm_s\": 2", "\"speed_mps\": 2e-3")).canonical_json == normal);
  CHECK(plan_of(small_with("\"dy_mm\": 50", "\"dy_m\": 0.05")).canonical_json == normal);
  CHECK(plan_of(small_with(order_stub,
                           "\"seed\": 1, \"repetitions\": 2, \"source\": \"x\", "
                           "\"order\": {\"kind\": \"blocked\"}"))
            .canonical_json == normal);
  CHECK(plan_of(small_with(order_stub, "\"repetitions\": 3")).canonical_json != normal);
  CHECK(plan_of(small_with("\"force_N\": 5", "\"force_N\": 5.001")).canonical_json != normal);
}

TEST_CASE("A rig that names its fabrics gets no warning, another gets one") {
  CHECK(check_recipe(small_recipe, test::limits()).warnings.size() == 1);
  RigLimits named = test::limits();
  named.fabrics = {"denim", "silk"};
  CHECK(check_recipe(small_recipe, named).warnings.empty());
}

}  // namespace plan_test
