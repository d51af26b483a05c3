// The importance of features, and the accuracy with the important ones.

#include "classifier/vibro/importance.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "classifier/vibro/cross_validation.hpp"
#include "tests/unit/classifier/noise_levels.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::vibro::vibro_importance_test {
namespace {

using namespace noise_levels;

TEST_CASE("Dealing out the values of the feature that matters costs accuracy, of others nothing") {
  const auto recordings = levels(2, 1, 60.0);
  const Cut c = cut(recordings, with(Protocol::blocks), {Family::smmrp10, Combine::concat});
  const Matrix test = c.windows.matrix.values.take(c.splits[0].test);
  std::vector<std::size_t> other;
  for (const std::size_t r : c.splits[0].test)
    other.push_back(c.windows.matrix.labels[r] == "a" ? 0 : 1);
  const auto tree = train_recipe(select_rows(c.windows.matrix, c.splits[0].train),
                                 window_recipe(Learner::tree), {})
                        .value();
  const auto importance = permutation_importance(tree, test, other, 5, 1).value();
  const auto best = most_important(importance, 5);
  REQUIRE(best.size() == 5);
  CHECK(importance[best[0]].mean > 0.3);
  // A single tree that separates two levels of noise with one cut uses one of the levels.
  CHECK((best[0] == 1 || best[0] == 2 || best[0] == 3 || best[0] == 8));
  CHECK(importance[9].mean == 0.0);  // ZCR does not depend on the level
  CHECK_FALSE(permutation_importance(tree, test, other, 0, 1));
  CHECK_FALSE(permutation_importance(tree, Matrix(), {}, 5, 1));
}

TEST_CASE("Features of equal cost are ordered by their share in a forest") {
  const std::vector<Importance> importance{{0.0, 0}, {0.2, 0}, {0.0, 0}, {0.2, 0}};
  const std::vector<double> shares{0.1, 0.2, 0.3, 0.4};
  CHECK(most_important(importance, 4, shares) == std::vector<std::size_t>{3, 1, 2, 0});
  CHECK(most_important(importance, 3) == std::vector<std::size_t>{1, 3, 0});
}

TEST_CASE("Features are weighed on test windows and by a forest, over all splits") {
  const auto recordings = levels(2, 2, 60.0);
  const Cut c = cut(recordings, with(Protocol::groups), {Family::smmrp10, Combine::concat});
  const Recipe lda = window_recipe(Learner::lda);
  TrainOptions options;
  options.trees = 50;
  const auto weighed = weigh_features(c.windows, c.splits, lda, options, 3).value();
  REQUIRE(weighed.permutation.size() == 10);
  REQUIRE(weighed.forest.size() == 10);
  CHECK(std::accumulate(weighed.forest.begin(), weighed.forest.end(), 0.0) == Approx(1.0));
  // The level is in MEAN's spread, STD, MAD, RMSE and PERCEPTUAL; not in ZCR.
  const auto most = std::max_element(weighed.forest.begin(), weighed.forest.end());
  CHECK(weighed.forest[9] < 0.25 * *most);
  CHECK(std::abs(weighed.permutation[9].mean) < 0.1);
  // One split gives the result of permutation_importance().
  const auto first =
      weigh_features(c.windows, std::span(c.splits).first(1), lda, options, 3).value();
  const auto second =
      weigh_features(c.windows, std::span(c.splits).last(1), lda, options, 3).value();
  for (std::size_t f = 0; f < 10; ++f)
    CHECK(weighed.permutation[f].mean ==
          Approx((first.permutation[f].mean + second.permutation[f].mean) / 2).margin(1e-12));
  CHECK_FALSE(weigh_features(c.windows, {}, lda, options, 3));
  CHECK_FALSE(weigh_features(c.windows, c.splits, lda, options, 0));
}

// Recordings with a replaced matrix: in training column 0 separates the classes best and column 1
// second best; in the test windows only column 1 does. The others are noise.
Cut made_to_mislead() {
  Cut out = cut(levels(2, 3), with(Protocol::groups), {Family::smmrp10, Combine::concat});
  RandomEngine engine(3);
  classifier::FeatureMatrix& matrix = out.windows.matrix;
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    for (std::size_t f = 0; f < matrix.names.size(); ++f)
      matrix.values(r, f) = classifier::testing::normal(engine);
    const double side = matrix.labels[r] == "a" ? -1.0 : 1.0;
    if (matrix.groups[r] != "3") matrix.values(r, 0) += 3.0 * side;
    matrix.values(r, 1) += 2.0 * side;
  }
  std::erase_if(out.splits,
                [&](const Split& split) { return matrix.groups[split.test.front()] != "3"; });
  return out;
}

TEST_CASE("Features are selected on the training windows of each split, never on test windows") {
  const Cut c = made_to_mislead();
  REQUIRE(c.splits.size() == 1);
  const Recipe lda = window_recipe(Learner::lda);
  const TrainOptions options = window_training({}, Protocol::groups);
  const auto one = reach_by_selection(c.windows, c.splits, lda, options, 1, 5).value();
  CHECK(one.retained == std::vector<std::vector<std::size_t>>{{0}});
  CHECK(one.accuracy < 0.7);  // training could not show this
  const std::vector<std::size_t> first{0}, second{1};
  CHECK(one.accuracy == reach_with(c.windows, c.splits, lda, options, first)->accuracy);
  const auto other = reach_with(c.windows, c.splits, lda, options, second).value();
  CHECK(other.accuracy > 0.9);
  CHECK(other.retained.front() == second);

  // With every column it equals cross_validate(), on the same number of splits.
  const auto recordings = levels(2, 3);
  const Cut all = cut(recordings, with(Protocol::groups), {Family::smmrp10, Combine::concat});
  REQUIRE(all.splits.size() == 3);
  const auto whole = reach_by_selection(all.windows, all.splits, lda, options, 10, 2).value();
  const auto assessed =
      cross_validate(all.windows, all.splits, std::span(&lda, 1), options).value();
  CHECK(whole.split_accuracy == assessed.split_accuracy);
  CHECK(whole.accuracy == Approx(assessed.accuracy));
  CHECK(whole.f_score == Approx(assessed.f_score));
  CHECK(whole.retained.size() == 3);

  // Two groups: the training group cannot be split, and is tested on itself.
  const Cut few = cut(levels(2, 2), with(Protocol::groups), {Family::smmrp10, Combine::concat});
  CHECK(reach_by_selection(few.windows, few.splits, lda, options, 5, 2)->accuracy > 0.9);
  CHECK_FALSE(reach_by_selection(c.windows, {}, lda, options, 5, 2));
  CHECK_FALSE(reach_by_selection(c.windows, c.splits, lda, options, 0, 2));
  CHECK_FALSE(reach_by_selection(c.windows, c.splits, lda, options, 5, 0));
  CHECK_FALSE(reach_with(c.windows, c.splits, lda, options, {}));
}

}  // namespace
}  // namespace weft::classifier::vibro::vibro_importance_test
