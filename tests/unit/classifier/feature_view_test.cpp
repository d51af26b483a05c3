#include "classifier/learn/feature_view.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "classifier/evaluate/splits.hpp"
#include "classifier/learners/learner.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::feature_view_test {
namespace {

Matrix column(const std::vector<double>& values) {
  Matrix out(values.size(), 1);
  for (std::size_t r = 0; r < values.size(); ++r) out(r, 0) = values[r];
  return out;
}

TEST_CASE("Names of views come back, others are refused with those that exist") {
  for (const View view : tried_views()) CHECK(*view_from(to_string(view)) == view);
  const auto wrong = view_from("oblique");
  REQUIRE_FALSE(wrong);
  CHECK(wrong.error().expected ==
        "plain, compressed, ranked, normal-scores, standardised, components");
}

TEST_CASE("A place is the share of training values below, in the middle of equal ones") {
  const RankTable ranks = RankTable::fit(column({30, 10, 20, 20}));  // places 1/8, 3/8, 5/8, 7/8
  CHECK(ranks.place(0, 10) == 0.125);
  CHECK(ranks.place(0, 20) == 0.5);
  CHECK(ranks.place(0, 30) == 0.875);
  CHECK(ranks.place(0, 15) == 0.25);
  CHECK(ranks.place(0, 25) == 0.75);
  CHECK(ranks.place(0, -1e300) == 0.125);
  CHECK(ranks.place(0, 1e300) == 0.875);
}

TEST_CASE("Places do not change when a feature is stretched by any rising function") {
  RandomEngine engine(5);
  std::vector<double> values(40), stretched(40);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = testing::normal(engine);
    stretched[i] = std::exp(20.0 * values[i]);
  }
  const RankTable a = RankTable::fit(column(values)), b = RankTable::fit(column(stretched));
  for (std::size_t i = 0; i < values.size(); ++i)
    CHECK(a.place(0, values[i]) == b.place(0, stretched[i]));
}

TEST_CASE("Quantiles of many training values are kept, and places are those of all values") {
  RandomEngine engine(6);
  std::vector<double> values(10'000);
  for (double& value : values) value = testing::normal(engine);
  const RankTable ranks = RankTable::fit(column(values));
  CHECK(ranks.knots().rows() == RankTable::most_knots);
  double before = 0.0;
  for (const double value : {-2.0, -1.0, -0.1, 0.0, 0.5, 1.5, 2.2}) {
    std::size_t below = 0;
    for (const double other : values) below += other < value ? 1 : 0;
    const double place = ranks.place(0, value);
    CHECK(place == Approx(static_cast<double>(below) / 10'000).margin(0.5 / RankTable::most_knots));
    CHECK(place > before);
    before = place;
  }
}

TEST_CASE("A feature that was constant in the training is ignored for any value") {
  for (const double level : {0.0, 5.0, -1e300, 5e-324}) {
    const RankTable ranks = RankTable::fit(column({level, level, level}));
    for (const double value : {level, -7.0, 1e308}) CHECK(ranks.place(0, value) == 0.5);
  }
  CHECK(RankTable::fit(column({1.0, 1.0 + 1e-15})).place(0, 3.0) == 0.5);
  CHECK(RankTable::fit(column({3.0})).place(0, 4.0) == 0.5);
}

TEST_CASE("Places stay between 0 and 1 and never fall at the ends of double") {
  const double top = std::numeric_limits<double>::max();
  const RankTable ranks =
      RankTable::fit(column({-top, -1e300, -1.0, 0.0, 5e-324, 2.0, 1e300, top}));
  double before = 0.0;
  for (const double value :
       {-top, -1e305, -1e300, -2.0, -0.5, -0.0, 5e-324, 1e-323, 1.0, 1e299, 1e301, 1e308, top}) {
    const double place = ranks.place(0, value);
    CAPTURE(value, place);
    CHECK((place >= before && place > 0.0 && place < 1.0));
    before = place;
  }
}

TEST_CASE("Normal scores are the quantiles of a normal distribution at the places") {
  const NormalScores four(RankTable::fit(column({30, 10, 20, 40})));
  const double low = -1.1503493803760079, high = -0.31863936396437514;  // scipy, norm.ppf, 1/8, 3/8
  CHECK(four.score(0, 10) == Approx(low).epsilon(1e-14));
  CHECK(four.score(0, 20) == Approx(high).epsilon(1e-14));
  CHECK(four.score(0, 30) == -four.score(0, 20));
  CHECK(four.score(0, 40) == -four.score(0, 10));
  CHECK(four.score(0, 15) == Approx((low + high) / 2));
  CHECK(four.score(0, 25) == 0.0);
  CHECK(four.score(0, -1e300) == four.score(0, 10));
  CHECK(four.score(0, 1e300) == four.score(0, 40));
  const NormalScores tied(RankTable::fit(column({1, 2, 2, 2, 3})));
  CHECK(tied.score(0, 2) == 0.0);
  std::vector<double> many(RankTable::most_knots);
  for (std::size_t k = 0; k < many.size(); ++k) many[k] = static_cast<double>(k);
  const NormalScores most(RankTable::fit(column(many)));
  CHECK(most.score(0, 0) == Approx(-2.8856349124267573).epsilon(1e-14));  // norm.ppf, 0.5 / 256
}

TEST_CASE("A feature that did not vary in the training has the score 0") {
  for (const std::vector<double>& level : {std::vector<double>{3.0}, {3.0, 3.0}, {5e-324, 5e-324}})
    CHECK(NormalScores(RankTable::fit(column(level))).score(0, 4.0) == 0.0);
}

TEST_CASE("A view of rows is the view of each, and the plain one changes nothing") {
  const FeatureMatrix data = testing::gaussian_classes(2, 9, 4, 1.0, 3);
  for (const View kind : tried_views()) {
    const FeatureView view = FeatureView::fit(kind, data.values);
    CHECK(view.kind() == kind);
    const Matrix all = view.apply(data.values);
    for (std::size_t r = 0; r < data.size(); ++r) {
      const std::vector<double> one = view.apply(data.values.row(r));
      CHECK(std::equal(one.begin(), one.end(), all.row(r).begin()));
    }
    const auto before = data.values.row(0);
    CHECK(std::equal(before.begin(), before.end(), all.row(0).begin()) == (kind == View::plain));
  }
}

// Two classes that differ by the sign of their middle part only; every row has one outlier
// elsewhere.
TEST_CASE("Ranks find what tails hide") {
  RandomEngine engine(9);
  FeatureMatrix data = testing::gaussian_classes(2, 60, 12, 0.0, 8);
  for (std::size_t r = 0; r < data.size(); ++r)
    for (std::size_t c = 0; c < 12; ++c) {
      const double lift = data.labels[r] == "classa" ? 0.8 : 0.0;
      data.values(r, c) = std::sinh(4.0 * (testing::normal(engine) + lift));
    }
  const auto split = stratified_splits(data.labels, 0.5, 1, 2);
  REQUIRE(split);
  std::vector<std::size_t> right;
  for (const View view : {View::plain, View::ranked, View::normal_scores}) {
    const auto learner =
        train_recipe(select_rows(data, split->front().train), {Learner::lda, 20, view}, {});
    REQUIRE(learner);
    right.push_back(0);
    for (const std::size_t r : split->front().test)
      right.back() += learner->labels()[*learner->classify(data.values.row(r))] == data.labels[r];
  }
  for (const std::size_t by_rank : {right[1], right[2]}) {
    CHECK(by_rank > right[0] + 5);
    CHECK(by_rank >= 50);  // of 60; the best possible rule gets 55 +- 2
  }
}

}  // namespace
}  // namespace weft::classifier::feature_view_test
