// The unknown-fabric check, measured by leaving out each fabric once.

#include <catch2/catch.hpp>

#include "classifier/evaluate/open_set_check.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::open_set_check_test {
namespace {

Split halves(const FeatureMatrix& matrix) {
  Split out;
  for (std::size_t r = 0; r < matrix.size(); ++r) (r % 2 == 0 ? out.train : out.test).push_back(r);
  return out;
}

OpenSetCheck check_of(const FeatureMatrix& matrix, Learner learner) {
  const std::vector<Split> splits(2, halves(matrix));
  const std::vector<Recipe> recipes(2, Recipe{learner, 20});
  return check_open_set(matrix, splits, recipes, {}).value();
}

TEST_CASE("Fabrics far from each other are strangers to each other, equal ones are not") {
  for (const Learner learner : {Learner::lda, Learner::svc, Learner::trees, Learner::pvalue}) {
    INFO(to_string(learner));
    const FeatureMatrix apart = testing::gaussian_classes(4, 20, 4, 40.0, 3);
    const OpenSetCheck far = check_of(apart, learner);
    CHECK(far.false_accept == 0.0);
    CHECK(far.false_reject < 0.3);
    REQUIRE(far.unknown_labels.size() == 4);
    for (const UnknownLabel& one : far.unknown_labels) {
      CHECK(one.trials == 10);
      CHECK(one.answers == 20);  // the same ten in both splits
      CHECK(one.accepted == 0);
    }
    CHECK(far.unknown_labels[0].label == "classa");
    const OpenSetCheck equal = check_of(testing::gaussian_classes(4, 20, 4, 0.0, 4), learner);
    CHECK(equal.false_accept > 0.7);
    CHECK(equal.false_accept_ci95.low < equal.false_accept);
    CHECK(equal.false_accept_ci95.high > equal.false_accept);
    // two equal splits give the information of one
    CHECK(equal.false_accept_ci95.low == Approx(wilson_of_share(equal.false_accept, 40).low));
  }
}

TEST_CASE("Columns that a learner does not use do not affect the open-set check") {
  FeatureMatrix matrix = testing::gaussian_classes(4, 20, 4, 40.0, 3);
  const std::vector<Split> splits = {halves(matrix)};
  const std::vector<Recipe> all = {Recipe{Learner::lda, 20}};
  const OpenSetCheck want = check_open_set(matrix, splits, all, {}).value();
  std::vector<Recipe> first = all;
  for (std::size_t k = 0; k < matrix.names.size(); ++k) first.front().columns.push_back(k);
  FeatureMatrix noise = matrix;
  RandomEngine engine(9);
  for (double& value : noise.values.data()) value = 1e3 * testing::normal(engine);
  append_columns(noise, "noise.", matrix);
  const OpenSetCheck got = check_open_set(matrix, splits, first, {}).value();
  CHECK(got.false_accept == want.false_accept);
  CHECK(got.false_reject == want.false_reject);
}

TEST_CASE("Leaving one of two fabrics out is refused, and so are splits without recipes") {
  const FeatureMatrix two = testing::gaussian_classes(2, 8, 3, 3.0, 5);
  const std::vector<Split> splits = {halves(two)};
  const std::vector<Recipe> recipes = {Recipe{Learner::lda, 20}};
  CHECK(check_open_set(two, splits, recipes, {}).error().expected == "at least 3");
  CHECK(check_open_set(two, splits, recipes, {}).error().got == "2");
  CHECK_FALSE(check_open_set(two, splits, {}, {}));
  CHECK_FALSE(check_open_set(two, {}, {}, {}));
}

TEST_CASE(
    "A fabric without which no threshold can be learnt is named, and the others are measured") {
  const FeatureMatrix all = testing::gaussian_classes(3, 12, 4, 40.0, 6);
  std::vector<std::size_t> saved;
  for (std::size_t r = 0; r < all.size(); ++r)
    if (all.labels[r] != "classc" || saved.size() < 26) saved.push_back(r);
  const FeatureMatrix rare = select_rows(all, saved);  // 12, 12, 2
  Split split;
  for (std::size_t r = 0; r < rare.size(); ++r) split.train.push_back(r);
  split.test = split.train;
  const std::vector<Split> splits = {split};
  const std::vector<Recipe> recipes = {Recipe{Learner::lda, 20}};
  const auto check = check_open_set(rare, splits, recipes, {});
  REQUIRE(check);
  CHECK(check->not_measured == std::vector<std::string>{"classa", "classb"});
  REQUIRE(check->unknown_labels.size() == 1);
  CHECK(check->unknown_labels.front().label == "classc");
}

}  // namespace
}  // namespace weft::classifier::open_set_check_test
