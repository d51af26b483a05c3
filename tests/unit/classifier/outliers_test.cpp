// Outliers among training rows: the rows that are left out; a test row never is.

#include <catch2/catch.hpp>

#include <map>

#include "classifier/learners/learner.hpp"
#include "classifier/learners/outliers.hpp"
#include "classifier/vibro/cross_validation.hpp"
#include "tests/unit/classifier/noise_levels.hpp"

namespace weft::classifier::outliers_test {
namespace {

using LeftOut = std::map<std::string, std::size_t>;

// Ten rows of each of two labels, with a constant column and one that counts; `last` is the last
// value.
FeatureMatrix twenty(double last) {
  FeatureMatrix out;
  out.names = {"constant", "counting"};
  out.values = Matrix(20, 2);
  for (std::size_t r = 0; r < 20; ++r) {
    out.values(r, 0) = 7.0;
    out.values(r, 1) = r + 1 < 20 ? static_cast<double>(r % 10) : last;
    out.labels.push_back(r < 10 ? "a" : "b");
    out.groups.push_back("1");
    out.files.push_back(std::to_string(r));
  }
  return out;
}

TEST_CASE("A row beyond the deviations of all rows is left out, counted by its label") {
  // Column 2: 0 to 9, 0 to 8 and 100: mean 9.05, deviation 21.04; 100 lies 4.32 deviations off.
  FeatureMatrix rows = twenty(100.0);
  CHECK(remove_outliers(rows, 4.33).value() == LeftOut{{"a", 0}, {"b", 0}});
  CHECK(rows.size() == 20);
  CHECK(remove_outliers(rows, 4.31).value() == LeftOut{{"a", 0}, {"b", 1}});
  CHECK(rows.size() == 19);
  CHECK(rows.files.back() == "18");
  CHECK(rows.values.rows() == 19);
  FeatureMatrix untouched = twenty(100.0);
  CHECK(remove_outliers(untouched, 0.0).value().empty());
  CHECK(untouched.size() == 20);
}

TEST_CASE("A label of which every row is an outlier is refused by its name") {
  FeatureMatrix rows = twenty(9.0);
  for (std::size_t r = 0; r < 10; ++r) rows.values(r, 1) = 1000.0;  // one deviation away, like b
  for (std::size_t r = 5; r < 20; ++r) rows.labels[r] = "b";
  const auto refused = remove_outliers(rows, 0.5);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::range);
  CHECK(refused.error().where == "a");
  CHECK(rows.size() == 20);
}

TEST_CASE("A trained learner has seen no outlier, and answers one all the same") {
  const FeatureMatrix whole = twenty(100.0);
  FeatureMatrix clean = whole;
  REQUIRE(remove_outliers(clean, 4.0));
  const Recipe recipe{.learner = Learner::nb, .view = View::standardised};
  const auto learner = train_recipe(whole, recipe, {.outliers = 4.0});
  const auto want = train_recipe(clean, recipe, {});
  REQUIRE((learner && want));
  CHECK(learner->outliers() == LeftOut{{"a", 0}, {"b", 1}});
  CHECK(want->outliers().empty());
  for (std::size_t r = 0; r < whole.size(); ++r)
    CHECK(learner->predict(whole.values.row(r))->score ==
          want->predict(whole.values.row(r))->score);
}

TEST_CASE("Windows that test are never left out") {
  using namespace vibro;
  auto recordings = noise_levels::levels(3, 2);
  recordings[0].samples[0][1500] = 300.0;  // a knock in all five windows of the third block
  const auto c = noise_levels::cut(recordings, noise_levels::with(Protocol::blocks));
  const std::vector nb{window_recipe(Learner::nb)};
  const auto all = cross_validate(c.windows, c.splits, nb, {}).value();
  const auto without = cross_validate(c.windows, c.splits, nb, {.outliers = 4.0}).value();
  CHECK(all.outliers.empty());
  CHECK(without.outliers == LeftOut{{"a", 4 * 5}, {"b", 0}, {"c", 0}});  // in four of five splits
  CHECK(without.confusion.total() == all.confusion.total());
}

}  // namespace
}  // namespace weft::classifier::outliers_test
