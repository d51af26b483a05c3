// Welch's test compared with tests/golden/selection/welch.json, which make_welch.py wrote with
// scipy and with 60 decimal digits; and the selection by a training.

#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>

#include "classifier/fabric/model.hpp"
#include "classifier/selection/selection.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::welch_test {
namespace {

using testing::relative_difference;

struct Rows {
  Matrix values;
  std::vector<std::size_t> which;
  std::vector<int> sign;
};

Rows two_samples(const std::vector<double>& x, const std::vector<double>& y, double scale = 1.0) {
  Rows out{Matrix(x.size() + y.size(), 1), {}, std::vector<int>(x.size(), 1)};
  out.sign.resize(x.size() + y.size(), -1);
  for (std::size_t i = 0; i < out.sign.size(); ++i) {
    out.values(i, 0) = scale * (i < x.size() ? x[i] : y[i - x.size()]);
    out.which.push_back(i);
  }
  return out;
}

WelchTest welch(const Rows& rows) {
  return welch_statistics(rows.values, rows.which, rows.sign);
}

nlohmann::json golden() {
  std::ifstream in(WEFT_SOURCE_DIR "/tests/golden/selection/welch.json");
  return nlohmann::json::parse(in);
}

TEST_CASE("Welch's t, degrees of freedom and p are scipy's, and those of 60 digits to 1e-12") {
  const nlohmann::json cases = golden();
  double least_p = 1.0, least_log = 0.0;
  std::size_t broken_df = 0;
  for (const nlohmann::json& c : cases) {
    const WelchTest one = welch(two_samples(c["x"], c["y"]));
    const double t = c["t"], df = c["df"], p = c["p"], log_p = c["log_p"], scipy_p = c["scipy_p"];
    INFO("df " << df << " t " << t << " p " << p);
    CHECK(relative_difference(one.t[0], t) < 1e-12);
    CHECK(relative_difference(one.t[0], c["scipy_t"]) < 1e-12);
    CHECK(relative_difference(one.df[0], df) < 1e-12);
    CHECK(relative_difference(one.log_p[0], log_p) < 1e-12);
    CHECK(relative_difference(two_sided_p(t, df), p) < 1e-12);
    CHECK(relative_difference(std::exp(one.log_p[0]), scipy_p) < 1e-12);
    if (p > 0.0) least_p = std::min(least_p, p);
    least_log = std::min(least_log, log_p);
    broken_df += df != std::floor(df) ? 1 : 0;
  }
  CHECK(least_p < 1e-298);
  CHECK(least_log < -800.0);  // where p underflows, its logarithm does not
  CHECK(broken_df == cases.size());
}

TEST_CASE("Welch's test of sides that are alike is the pooled one") {
  const Rows rows = two_samples({1, 2, 3, 4}, {5, 7, 6, 8});
  const WelchTest one = welch(rows);
  CHECK(one.t[0] == Approx(testing::t_of_all(rows.values, rows.sign)[0]).epsilon(1e-14));
  CHECK(one.df[0] == Approx(6.0).epsilon(1e-14));
}

TEST_CASE("Welch's test does not change with scale, from the smallest numbers to the largest") {
  const std::vector<double> x = {1, 2, 3}, y = {4, 5, 9, 30};
  const WelchTest want = welch(two_samples(x, y));
  for (const double scale : {1e-305, 1e-30, 1e30, 5e306}) {
    const WelchTest one = welch(two_samples(x, y, scale));
    CHECK(one.t[0] == Approx(want.t[0]).epsilon(1e-12));
    CHECK(one.df[0] == Approx(want.df[0]).epsilon(1e-12));
  }
}

TEST_CASE("Welch's test where variances are missing or rounding only is the pooled one, or 0") {
  for (const Rows& rows : {two_samples({3}, {4, 5, 6}), two_samples({4, 5, 6}, {3}),
                           two_samples({1, 1}, {2, 2}), two_samples({3, 3}, {3, 3})}) {
    const WelchTest one = welch(rows);
    const auto n = static_cast<double>(rows.sign.size());
    CHECK(one.t[0] == testing::t_of_all(rows.values, rows.sign)[0]);
    CHECK(one.df[0] == n - 2.0);
    CHECK(one.log_p[0] == log_two_sided_p(one.t[0], n - 2.0));
  }
  const WelchTest two = welch(two_samples({1}, {2}));
  CHECK(two.t[0] == 0.0);
  CHECK(two.log_p[0] == 0.0);
  // a constant side: its variance is 0, and the other's degrees of freedom remain
  CHECK(welch(two_samples({7, 7, 7, 7, 7}, {1, 2, 4})).df[0] == Approx(2.0).epsilon(1e-14));
}

TEST_CASE("A subset by log p holds p < delta, at most the cap and at least one") {
  const std::vector<double> log_p = {std::log(0.04), -900.0, std::log(0.5), std::log(1e-6)};
  const auto ranked = rank_by_t(log_p);
  CHECK(ranked == std::vector<std::size_t>{1, 3, 0, 2});
  CHECK(subset_size(log_p, ranked, 0.05, 20) == 3);
  CHECK(subset_size(log_p, ranked, 0.05, 2) == 2);
  CHECK(subset_size(log_p, ranked, 1e-5, 20) == 2);
  CHECK(subset_size(std::vector<double>{0.0}, std::vector<std::size_t>{0}, 0.05, 20) == 1);
}

// Column 0 is wide in the fabric with few trials: the pooled test underestimates its variance and
// ranks it first. Column 1 differs less, but more reliably.
FeatureMatrix unequal_spreads() {
  RandomEngine engine(5);
  FeatureMatrix out = testing::gaussian_classes(2, 12, 6, 0.0, 5);
  std::vector<std::size_t> saved = {0, 1, 2, 3};
  saved.resize(16);
  std::iota(saved.begin() + 4, saved.end(), std::size_t{12});
  out = select_rows(out, saved);
  for (std::size_t r = 0; r < 16; ++r) {
    const bool few = r < 4;
    out.values(r, 0) = few ? 9.0 + 5.0 * (r % 2 == 0 ? 1.0 : -1.0) : testing::normal(engine) * 0.1;
    out.values(r, 1) += few ? 3.0 : 0.0;
  }
  return out;
}

TEST_CASE("A training by Welch's test uses it in every p it keeps, and the default stays pooled") {
  const FeatureMatrix matrix = unequal_spreads();
  const auto pooled = train(matrix).value();
  const auto welch_one = train(matrix, {.t_test = TTest::welch}).value();
  const auto& by_pooled = pooled.cores()[0].info().selected;
  const auto& by_welch = welch_one.cores()[0].info().selected;
  CHECK(by_pooled[0].column == 0);
  CHECK(by_welch[0].column == 1);
  for (const SelectedFeature& f : by_pooled) CHECK(f.log_p == log_two_sided_p(f.t, 14.0));
  std::vector<int> sign(4, 1);
  sign.resize(16, -1);
  std::vector<std::size_t> every(16);
  std::iota(every.begin(), every.end(), std::size_t{0});
  const WelchTest want = welch_statistics(matrix.values, every, sign);
  for (const SelectedFeature& f : by_welch) {
    CHECK(f.t == want.t[f.column]);
    CHECK(f.log_p == want.log_p[f.column]);
    CHECK(f.p_value == std::exp(f.log_p));
  }
  CHECK(testing::votes_on(welch_one, matrix).size() == 16);
}

}  // namespace
}  // namespace weft::classifier::welch_test
