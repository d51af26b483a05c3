// The budget of a choice.

#include "classifier/learners/training_cost.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>

#include "classifier/learners/class_folds.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::training_cost_test {
namespace {

using testing::gaussian_classes;

TrainOptions with_budget(double budget) {
  TrainOptions out;
  out.threads = 1;
  out.budget = budget;
  return out;
}

// 120 rows: one round.
FeatureMatrix some_rows() {
  return gaussian_classes(3, 40, 6, 1.5, 52);
}

TrainingShape shape_of(const FeatureMatrix& matrix) {
  return {matrix.size(), matrix.names.size(), 3, class_folds(matrix, with_budget(0)).folds.size()};
}

std::vector<Recipe> few() {
  return {{Learner::nb},
          {Learner::lda},
          {Learner::all},
          {Learner::lda, 20, View::ranked},
          {Learner::svc}};
}

std::size_t skipped_of(const std::vector<RecipeScore>& scores) {
  return static_cast<std::size_t>(std::ranges::count_if(scores, &RecipeScore::skipped));
}

TEST_CASE("a budget for the first candidates chooses as if there were no others") {
  const FeatureMatrix matrix = some_rows();
  const auto recipes = few();
  double budget = 0.0;
  for (std::size_t k = 1; k <= recipes.size(); ++k) {
    budget += training_cost(recipes[k - 1], shape_of(matrix), with_budget(0));
    const auto limited = train_best(matrix, recipes, with_budget(budget));
    const auto alone = train_best(matrix, std::span(recipes).first(k), with_budget(0));
    REQUIRE((limited && alone));
    CAPTURE(k);
    CHECK(limited->recipe == alone->recipe);
    REQUIRE(limited->scores.size() == recipes.size());
    for (std::size_t i = 0; i < recipes.size(); ++i) {
      const RecipeScore& score = limited->scores[i];
      CHECK(score.recipe == recipes[i]);
      CHECK(score.skipped() == (i >= k));
      CHECK((score.tested > 0) == (i < k));
      if (alone->scores.empty() || i >= k) continue;
      CHECK(score.errors == alone->scores[i].errors);
      CHECK(score.tested == alone->scores[i].tested);
    }
  }
}

TEST_CASE("one that exceeds the budget costs nothing, and a cheaper one after it is tried") {
  const FeatureMatrix matrix = some_rows();
  const std::vector<Recipe> recipes{{Learner::nb}, {Learner::forest}, {Learner::lda}};
  const TrainingShape shape = shape_of(matrix);
  const double budget = training_cost(recipes[0], shape, with_budget(0)) +
                        training_cost(recipes[2], shape, with_budget(0));
  const auto scores = within_budget(recipes, shape, with_budget(budget));
  CHECK_FALSE(scores[0].skipped());
  CHECK(scores[1].skipped());
  CHECK_FALSE(scores[2].skipped());
}

TEST_CASE("where the first exceeds the budget it is trained untested") {
  const FeatureMatrix matrix = some_rows();
  const std::vector<Recipe> recipes{{Learner::all}, {Learner::nb}, {Learner::lda}};
  const double first = training_cost(recipes[0], shape_of(matrix), with_budget(0));
  const auto chosen = train_best(matrix, recipes, with_budget(first * 0.999));
  REQUIRE(chosen);
  CHECK(chosen->recipe == recipes[0]);
  CHECK(chosen->trained.kind() == Learner::all);
  CHECK(skipped_of(chosen->scores) == recipes.size());
  for (const RecipeScore& score : chosen->scores) CHECK(score.tested == 0);
}

TEST_CASE("no budget, 0 or infinite, skips nothing; nor does one where nothing can be tested") {
  const auto recipes = few();
  const TrainingShape huge{1'000'000, 1000, 100, 5}, untestable{1'000'000, 1000, 100, 0};
  for (const double none : {0.0, std::numeric_limits<double>::infinity()})
    CHECK(skipped_of(within_budget(recipes, huge, with_budget(none))) == 0);
  CHECK(skipped_of(within_budget(recipes, huge, with_budget(60))) == recipes.size());
  CHECK(skipped_of(within_budget(recipes, untestable, with_budget(60))) == 0);
}

TEST_CASE("the cost rises with every number of the shape, whatever the learner") {
  const TrainingShape from{100, 20, 4, 5};
  const TrainOptions options;
  for (const Learner learner : all_learners())
    for (const View view : {View::plain, View::components}) {
      if (is_choice(learner)) continue;
      const Recipe recipe{learner, 20, view, view == View::components ? 8U : 0U};
      const double cost = training_cost(recipe, from, options);
      CAPTURE(to_string(recipe));
      CHECK(cost > 0.0);
      CHECK(training_cost(recipe, {200, 20, 4, 5}, options) > cost);
      CHECK(training_cost(recipe, {100, 40, 4, 5}, options) > cost);
      CHECK(training_cost(recipe, {100, 20, 4, 10}, options) > cost);
      CHECK(training_cost(recipe, {100, 20, 8, 5}, options) > cost);
    }
}

TEST_CASE("a recipe of few columns costs what a matrix of these alone does") {
  Recipe some{Learner::lda};
  some.columns = {1, 5, 7};
  const TrainingShape wide{100, 50, 4, 5}, narrow{100, 3, 4, 5};
  CHECK(training_cost(some, wide, {}) == training_cost({Learner::lda}, narrow, {}));
}

TEST_CASE("the default budget tries every candidate on a set of the usual size") {
  const auto of_fabrics = candidates(Learner::best);
  CHECK(skipped_of(within_budget(of_fabrics, {340, 195, 17, 5}, {})) == 0);
  CHECK(skipped_of(within_budget(of_fabrics, {99, 195, 17, 25}, {})) == 0);
}

TEST_CASE("what was not tried is named, and nothing else") {
  const auto recipes = few();
  auto scores = within_budget(recipes, {120, 6, 3, 5}, with_budget(0));
  CHECK(format_skipped(scores).empty());
  scores[2].budget_s = scores[4].budget_s = 60;
  const std::string text = format_skipped(scores);
  CHECK(text.find(to_string(recipes[2])) != std::string::npos);
  CHECK(text.find(to_string(recipes[4])) != std::string::npos);
  CHECK(text.find(to_string(recipes[1])) == std::string::npos);
}

}  // namespace
}  // namespace weft::classifier::training_cost_test
