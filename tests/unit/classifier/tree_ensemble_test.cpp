// Extremely randomised trees: valid splits, the joint prediction, and their bytes.

#include "classifier/learners/tree_ensemble.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numeric>

#include "classifier/fabric/folds.hpp"
#include "classifier/learners/learner.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::tree_ensemble_test {
namespace {

using testing::gaussian_classes;

TreeEnsemble fitted(const FeatureMatrix& data, const TrainOptions& options = {},
                    std::size_t trees = 50) {
  const Classes classes = find_classes(data);
  auto out = fit_extra_trees(data.values, classes.of_row, classes.labels.size(), options, trees);
  REQUIRE(out);
  return std::move(*out);
}

std::string format_text(const TreeEnsemble& trees) {
  LineWriter out;
  trees.write(out);
  return out.str();
}

TEST_CASE("A random threshold lies anywhere between two values, a best one half way") {
  Matrix rows(2, 1);
  rows(1, 0) = 1.0;
  const std::vector<std::size_t> of_row = {0, 1};
  const RankedRows ranked(rows, of_row, 2);
  const auto threshold_of = [&](const SplitRule& rule, std::uint64_t seed) {
    RandomEngine engine(seed);
    const DecisionTree tree = DecisionTree::grow(ranked, {0, 1}, rule, engine, {});
    CHECK(tree.leaves() == 2);
    double low = 0.0, high = 1.0;  // `low` goes left, `high` goes right
    for (int step = 0; step < 60; ++step) {
      const double at = 0.5 * (low + high);
      std::vector<double> shares(2, 0.0);
      tree.add_shares(std::vector{at}, shares);
      (shares[0] > 0.5 ? low : high) = at;
    }
    return low;
  };
  std::vector<double> drawn;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    CHECK(threshold_of({1, false}, seed) == Approx(0.5));
    drawn.push_back(threshold_of({1, true}, seed));
  }
  // The mean of 400 uniform numbers is 0.5 +- 0.0144, the mean square 1/3 +- 0.0149.
  const double n = static_cast<double>(drawn.size());
  CHECK(std::accumulate(drawn.begin(), drawn.end(), 0.0) / n == Approx(0.5).margin(0.06));
  CHECK(std::inner_product(drawn.begin(), drawn.end(), drawn.begin(), 0.0) / n ==
        Approx(1.0 / 3.0).margin(0.06));
}

TEST_CASE("The best of the drawn thresholds is taken: a feature that parts the classes wins") {
  Matrix rows(40, 2);
  std::vector<std::size_t> of_row;
  RandomEngine engine(4);
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    of_row.push_back(r % 2);
    rows(r, 0) = r % 2 == 0 ? 0.0 : 1.0;
    rows(r, 1) = random_unit(engine);  // useless
  }
  const RankedRows ranked(rows, of_row, 2);
  std::vector<std::uint32_t> all(rows.rows());
  std::iota(all.begin(), all.end(), 0U);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    RandomEngine own(seed);
    std::vector<double> importance(2, 0.0);
    CHECK(DecisionTree::grow(ranked, all, {2, true}, own, importance).leaves() == 2);
    CHECK(importance[0] == Approx(1.0));
  }
}

TEST_CASE("Trees on -0 and on 0 are the same, to the byte") {
  FeatureMatrix zeros = gaussian_classes(3, 8, 4, 2.0, 5);
  for (std::size_t r = 0; r < zeros.size(); ++r)
    if (r % 2 == 0) zeros.values(r, 1) = 0.0;
  FeatureMatrix negative = zeros;
  for (std::size_t r = 0; r < negative.size(); r += 4) negative.values(r, 1) = -0.0;
  CHECK(format_text(fitted(negative)) == format_text(fitted(zeros)));
}

TEST_CASE("Trees know the rows they grew on, and shares are a distribution") {
  const FeatureMatrix data = gaussian_classes(4, 12, 6, 1.0, 21);
  const FeatureMatrix fresh = gaussian_classes(4, 25, 6, 1.0, 22);
  const TreeEnsemble trees = fitted(data);
  const Classes classes = find_classes(data);
  for (std::size_t r = 0; r < data.size(); ++r) {
    const auto shares = trees.shares(data.values.row(r));
    CHECK(shares[classes.of_row[r]] == Approx(1.0));  // every leaf is pure
    CHECK(*trees.classify(data.values.row(r)) == classes.of_row[r]);
  }
  for (std::size_t r = 0; r < fresh.size(); ++r) {
    const auto shares = trees.shares(fresh.values.row(r));
    CHECK(std::accumulate(shares.begin(), shares.end(), 0.0) == Approx(1.0));
    const auto scores = trees.predict(fresh.values.row(r)).value();
    CHECK(scores.winner == trees.classify(fresh.values.row(r)).value());
    for (std::size_t c = 0; c < shares.size(); ++c)
      CHECK(scores.score[c] == Approx(std::log(std::max(shares[c], 0.01))));  // half of one of 50
  }
  CHECK_FALSE(trees.classify(std::vector{1.0}));
}

TEST_CASE("The same trees with any number of threads, others from another seed") {
  const FeatureMatrix data = gaussian_classes(3, 10, 5, 2.0, 31);
  TrainOptions one;
  one.threads = 1;
  TrainOptions three = one;
  three.threads = 3;
  TrainOptions other = one;
  other.seed = 2;
  CHECK(format_text(fitted(data, one)) == format_text(fitted(data, three)));
  CHECK(format_text(fitted(data, one)) != format_text(fitted(data, other)));
}

TEST_CASE("Stored trees come back to the byte and answer alike") {
  const FeatureMatrix data = gaussian_classes(3, 10, 5, 2.0, 41);
  const TreeEnsemble trees = fitted(data);
  const std::string text = format_text(trees);
  LineReader in(text);
  const TreeEnsemble again = TreeEnsemble::read(in, 5, 3);
  REQUIRE(in.ok());
  CHECK(format_text(again) == text);
  for (std::size_t r = 0; r < data.size(); ++r)
    CHECK(again.shares(data.values.row(r)) == trees.shares(data.values.row(r)));
}

TEST_CASE("Rows that cannot be told apart share a leaf, and constant columns are passed over") {
  Matrix rows(6, 3, 7.0);  // only the middle column differs, but not between the first two rows
  const std::vector<double> middle = {1, 1, 2, 3, 4, 5};
  for (std::size_t r = 0; r < 6; ++r) rows(r, 1) = middle[r];
  const std::vector<std::size_t> of_row = {0, 1, 1, 0, 1, 0};
  const auto trees = fit_extra_trees(rows, of_row, 2, {}, 40);
  REQUIRE(trees);
  CHECK(trees->shares(rows.row(0)) == std::vector{0.5, 0.5});
  CHECK(*trees->classify(rows.row(0)) == 0);  // the lowest of several
  for (std::size_t r = 2; r < 6; ++r) CHECK(*trees->classify(rows.row(r)) == of_row[r]);
}

TEST_CASE("Neighbouring doubles, subnormal ones and the largest that are allowed can be parted") {
  const double least = std::numeric_limits<double>::denorm_min();
  for (const auto& [low, high] : {std::pair{0.0, least},
                                  {1.0, std::nextafter(1.0, 2.0)},
                                  {-largest_feature, largest_feature},
                                  {-1.0, std::nextafter(-1.0, 0.0)}}) {
    Matrix rows(4, 1, low);
    rows(2, 0) = rows(3, 0) = high;
    const std::vector<std::size_t> of_row = {0, 0, 1, 1};
    const auto trees = fit_extra_trees(rows, of_row, 2, {}, 30);
    REQUIRE(trees);
    CHECK(trees->shares(rows.row(0)) == std::vector{1.0, 0.0});
    CHECK(trees->shares(rows.row(3)) == std::vector{0.0, 1.0});
  }
}

TEST_CASE("Trees without rows, without a class for each, or without a tree are refused") {
  const Matrix rows(3, 2, 1.0);
  const std::vector<std::size_t> two = {0, 1}, three = {0, 1, 1};
  CHECK_FALSE(fit_extra_trees(Matrix(), {}, 2, {}));
  CHECK_FALSE(fit_extra_trees(rows, two, 2, {}));
  CHECK_FALSE(fit_extra_trees(rows, three, 2, {}, 0));
}

// Steps along a few of many columns: an axis-parallel cut finds them, a distance does not.
FeatureMatrix steps_among_noise(std::size_t rows, std::uint64_t seed) {
  FeatureMatrix out = gaussian_classes(2, rows / 2, 40, 0.0, seed);
  RandomEngine engine(seed + 1);
  for (std::size_t r = 0; r < out.size(); ++r) {
    for (std::size_t k = 0; k < 40; ++k) out.values(r, k) = random_unit(engine);
    const bool inside = std::abs(out.values(r, 0) - 0.5) < 0.3;
    out.labels[r] = inside ? "inside" : "outside";
  }
  return out;
}

TEST_CASE("The choice takes trees where they have the fewest errors, and only then") {
  const FeatureMatrix steps = steps_among_noise(160, 51);
  const auto chosen = train_learner(steps, Learner::best, {});
  REQUIRE(chosen);
  CHECK(chosen->recipe == Recipe{Learner::trees, 20});
  CHECK(chosen->trained.kind() == Learner::trees);
  for (const RecipeScore& score : chosen->scores)
    CHECK((score.recipe == chosen->recipe || score.errors > chosen->scores.back().errors));
  const auto clouds = train_learner(gaussian_classes(3, 40, 6, 2.0, 52), Learner::best, {});
  REQUIRE(clouds);
  CHECK(clouds->recipe.learner != Learner::trees);
}

}  // namespace
}  // namespace weft::classifier::tree_ensemble_test
