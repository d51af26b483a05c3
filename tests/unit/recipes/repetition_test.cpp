// The piece of the fabric that a trial touches, its mountings, and the place.

#include <catch2/catch.hpp>
#include <map>
#include <set>

#include "recipes/engine/motion.hpp"
#include "recipes/engine/operator_steps.hpp"
#include "tests/unit/recipes/engine_bench.hpp"

namespace repetition_test {

using namespace weft;
using namespace weft::recipes;
using test::small_with;

namespace {

/// Two fabrics, one exploration, `repetitions` repetitions, and more keys.
std::string recipe(int repetitions, const std::string& repetition, const std::string& more = "") {
  return small_with("\"repetitions\": 2",
                    "\"repetitions\": " + std::to_string(repetitions) +
                        (repetition.empty() ? "" : ", \"repetition\": " + repetition) + more);
}

std::vector<TrialPlace> places(const std::string& text) {
  std::vector<TrialPlace> out;
  for (const TrialSpec& trial : test::plan_of(text).trials) out.push_back(trial.place);
  return out;
}

std::string refused_at(const std::string& text, const RigLimits& limits = test::limits()) {
  const CheckReport report = check_recipe(text, limits);
  return report.problems.size() == 1 ? report.problems[0].pointer : "";
}

}  // namespace

TEST_CASE("Without a word of it a fabric is mounted once and its path is retraced") {
  for (const TrialPlace& place : places(recipe(3, ""))) CHECK(place == TrialPlace{});
  CHECK(places(recipe(3, "")) ==
        places(recipe(3, R"({"path": "same", "remount_every": "never", "piece": "one"})")));
  CHECK(test::plan_of(recipe(3, "")).canonical_json ==
        test::plan_of(recipe(3, R"({"path": "same"})")).canonical_json);
}

TEST_CASE("A fabric is mounted again after remount_every trials and after another fabric") {
  std::vector<std::uint32_t> mountings;
  for (const TrialPlace& place : places(recipe(5, R"({"remount_every": 2})")))
    mountings.push_back(place.mounting);
  CHECK(mountings == std::vector<std::uint32_t>{1, 1, 2, 2, 3, 1, 1, 2, 2, 3});
  const Plan plan = test::plan_of(recipe(5, R"({"remount_every": 2})"));
  CHECK(plan.forecast.mounts == 6);
  const Plan mixed =
      test::plan_of(recipe(4, "", R"(, "order": {"kind": "randomised", "seed": 3})"));
  std::size_t changes = 0;
  std::map<std::size_t, std::uint32_t> last;
  for (std::size_t i = 0; i < mixed.trials.size(); ++i) {
    const TrialSpec& trial = mixed.trials[i];
    const bool changed = i == 0 || mixed.trials[i - 1].fabric != trial.fabric;
    changes += changed ? 1 : 0;
    CHECK(trial.place.mounting == last[trial.fabric] + (changed ? 1 : 0));
    last[trial.fabric] = trial.place.mounting;
  }
  CHECK(mixed.forecast.mounts == changes);
}

TEST_CASE("Pieces share the repetitions in order, and a blocked order keeps each together") {
  const Plan plan = test::plan_of(recipe(5, R"({"piece": "each_label_split"})"));
  std::vector<std::uint32_t> pieces, repetitions;
  for (const TrialSpec& trial : plan.trials) {
    if (trial.fabric > 0) continue;
    pieces.push_back(trial.place.piece);
    repetitions.push_back(trial.repetition);
    CHECK(trial.place.mounting == trial.place.piece);
  }
  CHECK(pieces == std::vector<std::uint32_t>{1, 1, 1, 2, 2});
  CHECK(repetitions == std::vector<std::uint32_t>{1, 2, 3, 4, 5});
}

TEST_CASE("Any recipe's patches keep the probe on the plate, the first where the recipe starts") {
  for (const int repetitions : {1, 2, 7, 40}) {
    const Plan plan = test::plan_of(recipe(repetitions, R"({"path": "new_patch"})"));
    std::set<std::pair<double, double>> starts;
    for (const TrialSpec& trial : plan.trials) {
      CHECK(trial.place.patch == trial.repetition);
      if (trial.repetition == 1) CHECK(trial.place.offset_m == Vec2{});
      const Vec2 start = start_of(plan, trial);
      if (trial.fabric == 0) starts.emplace(start.x_m, start.y_m);
      const auto& path = plan.explorations[trial.exploration].path_m();
      for (std::size_t leg = 0; leg < path.size(); ++leg) {
        const Vec2 to =
            path_leg(plan.explorations[trial.exploration], leg, trial.place.offset_m).to_m;
        for (const Vec2& at : {start, to}) {
          CHECK(at.x_m >= 0.008 - 1e-9);
          CHECK(at.x_m <= 0.142 + 1e-9);
          CHECK(at.y_m >= 0.008 - 1e-9);
          CHECK(at.y_m <= 0.142 + 1e-9);
        }
      }
    }
    CHECK(starts.size() == static_cast<std::size_t>(repetitions));
    CHECK(plan.forecast.margin[index(Axis::x)] >= 0);
  }
}

TEST_CASE("A level's seed depends on its own level alone") {
  const Plan base = test::plan_of(recipe(4, ""));
  const Plan remounted = test::plan_of(recipe(4, R"({"remount_every": 1})"));
  const Plan split = test::plan_of(recipe(4, R"({"piece": "each_label_split"})"));
  for (std::size_t i = 0; i < base.trials.size(); ++i) {
    CHECK(remounted.trials[i].seeds.touch == base.trials[i].seeds.touch);
    CHECK(remounted.trials[i].seeds.piece == base.trials[i].seeds.piece);
    CHECK(split.trials[i].seeds.touch == base.trials[i].seeds.touch);
  }
  CHECK(remounted.trials[1].seeds.mounting != base.trials[1].seeds.mounting);
  CHECK(split.trials[3].seeds.piece != base.trials[3].seeds.piece);
  CHECK(base.trials[0].seeds.piece == base.trials[3].seeds.piece);
  CHECK(base.trials[0].seeds.piece != base.trials[4].seeds.piece);  // another fabric
}

TEST_CASE("An impossible repetition is refused, and a doubtful one gives a warning") {
  CHECK(refused_at(recipe(2, R"({"piece": "each_label_split", "pieces": 3})")) ==
        "/repetition/pieces");
  RigLimits small = test::limits();
  small.geometry.plate_size_m = {0.07, 0.07};
  CHECK(refused_at(recipe(2, R"({"path": "new_patch"})"), small) == "/repetition/path");
  CHECK(check_recipe(recipe(1, R"({"path": "new_patch"})"), small).problems.empty());
  RigLimits imprints = test::limits();
  imprints.imprint_array = true;
  CHECK(refused_at(recipe(2, R"({"remount_every": 1})"), imprints) == "/repetition");
  const auto warns = [](const std::string& text) {
    return check_recipe(text, test::limits()).warnings.size();
  };
  const std::size_t none = warns(recipe(2, ""));
  CHECK(warns(recipe(2, R"({"remount_every": 2})")) == none + 1);
  CHECK(warns(recipe(60, R"({"path": "new_patch"})")) == none + 1);
  CHECK(warns(recipe(4, "", R"(, "order": {"kind": "randomised", "seed": 3})")) == none + 1);
}

TEST_CASE("On a real bench a person is asked for each mounting, by piece and number") {
  RigLimits real = test::limits();
  real.bench = "real";
  const CheckReport report = check_recipe(recipe(2, R"({"piece": "each_label_split"})"), real);
  REQUIRE(report.plan);
  const Plan& plan = *report.plan;
  CHECK(plan.forecast.prompts == 4);
  const auto step = due_step(plan, 1, 0, false);
  REQUIRE(step);
  const std::string text = step_prompt(plan, 1, *step).text;
  CHECK(text.find("piece 2") != std::string::npos);
  CHECK(text.find("mounting 2") != std::string::npos);
  CHECK(check_recipe(recipe(2, ""), real).plan->forecast.prompts == 2);
}

TEST_CASE("The engine mounts the fabric of the plan and moves to its patch") {
  test::Bench b(test::plan_of(recipe(3, R"({"path": "new_patch", "remount_every": 2})")));
  for (std::size_t trial = 0; trial < 3; ++trial) {
    b.advance_to(Step::mounting);
    const auto mount = test::only<MountFabric>(b.effects);
    REQUIRE(mount);
    CHECK(mount->place == b.plan.trials[trial].place);
    b.advance_to(Step::positioning);
    const Joints above = above_start(b.plan, b.plan.trials[trial]).value();
    const auto across = test::only<MoveTo>(b.effects);
    REQUIRE(across);
    for (const AxisMove& move : across->moves) CHECK(move.target == above[move.axis]);
    b.advance_to(Step::sliding);
    const Vec2 to = path_leg(b.plan.explorations[0], 0, b.plan.trials[trial].place.offset_m).to_m;
    CHECK(test::only<MoveTo>(b.effects)->moves[0].target == Approx(to.y_m));
    b.advance_to(Step::ending);
  }
}

}  // namespace repetition_test
