// The unknown-fabric check: thresholds from the training part, false accepts on left-out fabrics.

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "classifier/vote/postprocessing.hpp"
#include "tests/bench/measure_reject.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::vote_reject_test {
namespace {

constexpr auto by_neighbour = static_cast<std::size_t>(RejectKind::neighbour);

FeatureMatrix rows_of(const std::vector<std::pair<std::string, double>>& rows) {
  FeatureMatrix out;
  out.names = {"x"};
  out.values = Matrix(rows.size(), 1);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    out.labels.push_back(rows[r].first);
    out.values(r, 0) = rows[r].second;
    out.groups.emplace_back("1");
    out.files.push_back(std::to_string(r));
  }
  return out;
}

TEST_CASE("the threshold is the conformal quantile of the scores") {
  std::vector<double> scores;
  for (int i = 99; i >= 1; --i) scores.push_back(i);
  CHECK(upper_threshold(scores, 0.05) == 95.0);
  CHECK(upper_threshold(scores, 0.5) == 50.0);
  CHECK(upper_threshold({3.0, 1.0, 2.0}, 0.05) == 3.0);
  CHECK(std::isinf(upper_threshold({}, 0.05)));
}

TEST_CASE("the neighbour score is distance over the neighbour's own distance to its class") {
  const FeatureMatrix matrix = rows_of({{"a", 0}, {"a", 1}, {"a", 3}, {"b", 10}, {"b", 14}});
  const ClassProfile profile{Matrix(2, 1), {1.0}};
  const std::vector<std::size_t> own{0, 0, 0, 1, 1}, unit{0, 1, 2, 3, 4};
  const RejectRule rule = fit_reject(matrix, profile, own, unit);
  CHECK(rule.radius == std::vector<double>{1, 1, 2, 4, 4});
  CHECK(rule.spread[1] == Approx(4.0));
  CHECK(rule.spread[0] == Approx((2.0 + 0.5 + 2.5) / 3.0));
  const double x[] = {6.0};
  CHECK(novelty(rule, profile, x, 0, 0.75)[0] == Approx(3.0 / 2.0));
  CHECK(novelty(rule, profile, x, 0, 0.75)[2] == 0.25);
  // without row 1: its nearest is 0, and the nearest other of that is 3
  CHECK(training_novelty(rule, profile, own, unit, 1, 0, 1.0)[0] == Approx(1.0 / 3.0));
}

TEST_CASE("windows of one recording do not stand in for each other") {
  const FeatureMatrix matrix = rows_of({{"a", 0}, {"a", 0.1}, {"a", 5}, {"b", 20}, {"b", 22}});
  const ClassProfile profile{Matrix(2, 1), {1.0}};
  const std::vector<std::size_t> own{0, 0, 0, 1, 1}, unit{0, 0, 2, 3, 4};
  const RejectRule rule = fit_reject(matrix, profile, own, unit);
  CHECK(rule.radius[0] == Approx(5.0));
  // no row of the class remains for row 2: its own radius is used
  CHECK(training_novelty(rule, profile, own, unit, 0, 0, 1.0)[0] == Approx(5.0 / 4.9));
}

TEST_CASE("duplicates and a single recording give usable radii, never a division by zero") {
  const FeatureMatrix matrix = rows_of({{"a", 1}, {"a", 1}, {"b", 2}, {"b", 2}, {"c", 9}});
  const ClassProfile profile{Matrix(3, 1), {1.0}};
  const std::vector<std::size_t> own{0, 0, 1, 1, 2}, unit{0, 1, 2, 3, 4};
  const RejectRule rule = fit_reject(matrix, profile, own, unit);
  for (const double r : rule.radius) CHECK(r == 1.0);
  for (const double value : {1.0, 1e308, -1e308}) {
    const double x[] = {value};
    for (const double score : novelty(rule, profile, x, 2, 1.0)) CHECK_FALSE(std::isnan(score));
  }
  RejectRule strict = rule;
  CHECK(strict.refuses({std::numeric_limits<double>::quiet_NaN(), 0, 0}));
}

TEST_CASE("fabrics far apart are refused when left out, and known trials about as often as asked") {
  const FeatureMatrix train_part = testing::gaussian_classes(6, 20, 6, 20.0, 41);
  const FeatureMatrix test_part = testing::gaussian_classes(6, 30, 6, 20.0, 42);
  const auto rules = measure_reject(train_part, test_part, {}, 0.1);
  REQUIRE(rules);
  const RejectRates& f = (*rules)[by_neighbour];
  INFO("accept " << f.false_accept << " reject " << f.false_reject);
  CHECK(f.false_accept < 0.02);
  CHECK(f.separation > 0.99);
  CHECK(f.false_reject < 0.2);
  CHECK(f.right_of_accepted > 0.95);
  REQUIRE(f.left_out.size() == 6);
  for (const LeftOut& one : f.left_out) CHECK(one.trials == 30);
  CHECK(f.false_accept_ci95.high < 0.06);
}

TEST_CASE("fabrics that are all the same cannot be refused when left out") {
  const FeatureMatrix train_part = testing::gaussian_classes(4, 15, 5, 0.0, 43);
  const FeatureMatrix test_part = testing::gaussian_classes(4, 25, 5, 0.0, 44);
  const auto rules = measure_reject(train_part, test_part, {});
  REQUIRE(rules);
  const RejectRates& f = (*rules)[by_neighbour];
  CHECK(f.false_accept > 0.8);
  CHECK(f.separation == Approx(0.5).margin(0.1));
}

TEST_CASE("a model without a fabric is the model that was trained without it") {
  const FeatureMatrix matrix = testing::gaussian_classes(4, 6, 4, 1.0, 17);
  const auto whole = train(matrix, {});
  REQUIRE(whole);
  std::vector<std::size_t> rows;
  for (std::size_t r = 0; r < matrix.size(); ++r)
    if (matrix.labels[r] != "classb") rows.push_back(r);
  const auto rest = train(select_rows(matrix, rows), {});
  REQUIRE(rest);
  const FabricModel cut = without_label(*whole, 1);
  CHECK(cut.labels() == rest->labels());
  for (std::size_t r = 0; r < matrix.size(); ++r)
    CHECK(cut.classify(matrix.values.row(r))->decision ==
          rest->classify(matrix.values.row(r))->decision);
}

TEST_CASE("nothing to leave out, nothing to test and unknown labels are refused") {
  const FeatureMatrix two = testing::gaussian_classes(2, 5, 3, 3.0, 1);
  CHECK(measure_reject(two, two, {}).error().expected == "at least 3");
  CHECK(measure_reject(two, two, {}).error().got == "2");
  const FeatureMatrix three = testing::gaussian_classes(3, 5, 3, 3.0, 1);
  FeatureMatrix strange = three;
  strange.labels[0] = "velvet";
  CHECK_FALSE(measure_reject(three, strange, {}));
  const auto model = train(three, {});
  REQUIRE(model);
  CHECK_FALSE(fit_postprocessing(*model, three, {}, 0.0));
  CHECK_FALSE(fit_postprocessing(*model, three, {}, 1.0));
  for (const RejectKind kind :
       {RejectKind::neighbour, RejectKind::class_mean, RejectKind::probability})
    CHECK(reject_kind_from(to_string(kind)).value() == kind);
  CHECK_FALSE(reject_kind_from("mood"));
}

}  // namespace
}  // namespace weft::classifier::vote_reject_test
