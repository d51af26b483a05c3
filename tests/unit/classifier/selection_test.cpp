#include <catch2/catch.hpp>
#include <limits>
#include <numbers>

#include "classifier/base/student_t.hpp"
#include "classifier/selection/selection.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::selection_test {
namespace {

using testing::relative_difference;

Matrix one_column(const std::vector<double>& values) {
  Matrix out(values.size(), 1);
  for (std::size_t i = 0; i < values.size(); ++i) out(i, 0) = values[i];
  return out;
}

TEST_CASE("p with one degree of freedom is Cauchy's, down to 1e-300") {
  for (const double t : {1e-8, 0.3, 1.0, 2.0, 50.0, 1e10, 1e200, 6e299}) {
    CHECK(relative_difference(two_sided_p(t, 1), 2.0 / std::numbers::pi * std::atan2(1.0, t)) <
          1e-12);
  }
}

TEST_CASE("p with two degrees of freedom has its closed form, down to 1e-300") {
  for (const double t : {1e-8, 0.3, 1.0, 1.7, 50.0, 1e10, 1e100, 1e150}) {
    const double s = std::sqrt(2.0 + t * t);
    CHECK(relative_difference(two_sided_p(t, 2), 2.0 / (s * (s + t))) < 1e-12);
  }
}

// 1 - sin(a) sum_k (2k-1)!!/(2k)!! cos(a)^2k, tan(a)^2 = t^2/df (Abramowitz and Stegun 26.7.4),
// evaluated in 800 decimal digits.
TEST_CASE("p agrees to 1e-12 with the finite sum of even degrees of freedom in 800 digits") {
  struct Case {
    double df, t, p;
  };
  for (const Case c :
       {Case{14, 0.001, 9.99216225228374809e-1}, Case{14, 1, 3.34281943394657590e-1},
        Case{14, 2.5, 2.54666646140621815e-2}, Case{14, 45, 1.51151209104949132e-16},
        Case{14, 1e21, 2.20812466875e-287}, Case{198, 10, 2.56101350052804288e-19},
        Case{198, 300, 3.62152508976074241e-265}, Case{1998, 2, 4.56354084882596560e-2},
        Case{1998, 30, 1.45760828551379296e-163}, Case{20000, 1.5, 1.33630187337684994e-1},
        Case{20000, 35, 1.56095056668085264e-260}}) {
    INFO("df " << c.df << " t " << c.t);
    CHECK(relative_difference(two_sided_p(c.t, c.df), c.p) < 1e-12);
    CHECK(two_sided_p(-c.t, c.df) == two_sided_p(c.t, c.df));
  }
}

TEST_CASE("Where p underflows its logarithm goes on") {
  CHECK(two_sided_p(1e5, 198) == 0.0);
  // leading term: p ~ 2 c (df/t^2)^(df/2) / df with c = df^(1/2)... so the slope in log t is -df
  const double slope = (log_two_sided_p(1e9, 198) - log_two_sided_p(1e8, 198)) / std::log(10.0);
  CHECK(slope == Approx(-198.0).epsilon(1e-9));
  CHECK(std::isfinite(log_two_sided_p(1e300, 1e6)));
}

TEST_CASE("p at the ends: 1 at t = 0, 0 at infinity, NaN for NaN or no degrees of freedom") {
  CHECK(two_sided_p(0.0, 5) == 1.0);
  CHECK(two_sided_p(1e-300, 5) == 1.0);
  CHECK(two_sided_p(std::numeric_limits<double>::infinity(), 5) == 0.0);
  CHECK(std::isnan(two_sided_p(std::nan(""), 5)));
  CHECK(std::isnan(two_sided_p(1.0, 0.0)));
}

TEST_CASE("p falls with |t| and with the degrees of freedom, across the change of formula") {
  for (const double df : {3.0, 14.0, 200.0}) {
    double last = 1.0;
    for (double t = 0.05; t < 12.0; t += 0.05) {
      const double p = two_sided_p(t, df);
      CHECK(p < last);
      last = p;
    }
  }
}

TEST_CASE("t of two small samples worked by hand") {
  // x = 1 2 3, y = 5 7 9 11: means 2 and 8, sums of squares 2 and 20, pooled variance 22/5
  const std::vector<int> sign = {1, 1, 1, -1, -1, -1, -1};
  const auto t = testing::t_of_all(one_column({1, 2, 3, 5, 7, 9, 11}), sign);
  CHECK(t[0] == Approx(-6.0 / std::sqrt(22.0 / 5.0 * (1.0 / 3.0 + 1.0 / 4.0))).epsilon(1e-14));
}

TEST_CASE("t does not change with scale or offset, from 1e-290 to 1e290") {
  const std::vector<int> sign = {1, 1, 1, -1, -1, -1};
  const double want = testing::t_of_all(one_column({1, 2, 3, 4, 5, 7}), sign)[0];
  for (const double scale : {1e-290, 1e-30, 1e30, 1e290}) {
    std::vector<double> values = {1, 2, 3, 4, 5, 7};
    for (double& v : values) v *= scale;
    CHECK(testing::t_of_all(one_column(values), sign)[0] == Approx(want).epsilon(1e-12));
  }
}

TEST_CASE(
    "Degenerate columns: equal constants give 0, rounding alone gives nothing, a true step is "
    "large") {
  const std::vector<int> sign = {1, 1, -1, -1};
  CHECK(testing::t_of_all(one_column({3, 3, 3, 3}), sign)[0] == 0.0);
  CHECK(testing::t_of_all(one_column({0, 0, 0, 0}), sign)[0] == 0.0);
  const double rounding = std::nextafter(0.1, 1.0);
  CHECK(std::abs(testing::t_of_all(one_column({0.1, 0.1, rounding, rounding}), sign)[0]) < 1e-6);
  const double step = testing::t_of_all(one_column({1, 1, 2, 2}), sign)[0];
  CHECK(std::isfinite(step));
  CHECK(step == Approx(-1.0 / 2e-9).epsilon(1e-9));
}

TEST_CASE("Features are ranked by |t|, equal ones by number") {
  CHECK(rank_by_t(std::vector<double>{1, -3, 3, 0, 2}) == std::vector<std::size_t>{1, 2, 4, 0, 3});
}

TEST_CASE("A subset holds p < delta, at most the cap and at least one") {
  const std::vector<double> t = {10, -9, 8, 0.1};
  const auto ranked = rank_by_t(t);
  CHECK(subset_size(t, ranked, 14, 0.05, 20) == 3);
  CHECK(subset_size(t, ranked, 14, 0.05, 2) == 2);
  CHECK(subset_size(t, ranked, 14, 1e-30, 20) == 1);
  CHECK(subset_size(t, ranked, 14, 1.0, 20) == 4);
}

TEST_CASE("The axes of correlated data are known, orthonormal and explain all of it") {
  Matrix rows(4, 3);  // points on the line (1, 2, 0), with a little along (2, -1, 0)
  const double along[] = {-2, -1, 1, 2};
  const double across[] = {0.1, -0.1, -0.1, 0.1};
  for (std::size_t r = 0; r < 4; ++r) {
    rows(r, 0) = along[r] + 2 * across[r];
    rows(r, 1) = 2 * along[r] - across[r];
  }
  const PcaBasis basis = pca_basis(rows, 20);
  REQUIRE(basis.axes.rows() == 2);
  CHECK(basis.axes(0, 0) == Approx(1.0 / std::sqrt(5.0)));
  CHECK(basis.axes(0, 1) == Approx(2.0 / std::sqrt(5.0)));
  CHECK(basis.axes(0, 2) == Approx(0.0).margin(1e-12));
  CHECK(basis.explained[0] == Approx(10.0 / 10.04).epsilon(1e-12));
  CHECK(basis.explained[1] == Approx(1.0));
  CHECK(components_for(basis, 0.9) == 1);
  CHECK(components_for(basis, 0.999) == 2);
  CHECK(components_for(basis, 1.0) == 2);
}

TEST_CASE("Wide and tall tables give the same axes, capped, and no variance gives one empty axis") {
  RandomEngine engine(3);
  Matrix wide(3, 5), tall(6, 5);
  for (std::size_t k = 0; k < 5; ++k) {
    const double a = testing::normal(engine), b = testing::normal(engine);
    const double values[] = {a, b, -a - b};
    for (std::size_t r = 0; r < 3; ++r) wide(r, k) = tall(r, k) = tall(r + 3, k) = values[r];
  }
  const PcaBasis w = pca_basis(wide, 20), t = pca_basis(tall, 20);
  REQUIRE(w.axes.rows() == 2);
  REQUIRE(t.axes.rows() == 2);
  for (std::size_t k = 0; k < 5; ++k) CHECK(w.axes(0, k) == Approx(t.axes(0, k)).margin(1e-9));
  CHECK(pca_basis(wide, 1).axes.rows() == 1);
  CHECK(pca_basis(Matrix(3, 5), 20).axes.rows() == 1);
}

TEST_CASE("Critical t has its closed forms and its tabled value, and undoes the tail") {
  const double p = 0.05;
  CHECK(critical_t(p, 1.0) == Approx(1.0 / std::tan(std::acos(-1.0) * p / 2.0)).epsilon(1e-12));
  CHECK(critical_t(p, 2.0) == Approx((1.0 - p) / std::sqrt(p * (2.0 - p) / 2.0)).epsilon(1e-12));
  CHECK(critical_t(p, 29.0) == Approx(2.045229642).epsilon(1e-9));  // printed tables: 2.045
  for (const double tail : {0.9, 1e-3, 1e-100})
    CHECK(two_sided_p(critical_t(tail, 14.0), 14.0) == Approx(tail).epsilon(1e-11));
  for (const double bad : {0.0, 1.0, -0.1, std::nan("")}) CHECK(std::isnan(critical_t(bad, 5.0)));
  CHECK(std::isnan(critical_t(0.05, 0.0)));
}

TEST_CASE("RareT agrees with the p-value, also next to the border") {
  const RareT rare;
  for (const double df : {1.0, 11.0, 14.0, 300.0}) {
    for (const double delta : {1e-5, 0.05, 0.999}) {
      const double limit = critical_t(delta, df);
      for (const double factor : {0.0, 0.5, 1 - 1e-8, 1 - 1e-12, 1.0, 1 + 1e-12, 1 + 1e-8, 3.0})
        CHECK(rare(-limit * factor, df, delta) == (two_sided_p(limit * factor, df) < delta));
    }
  }
  CHECK(rare(0.5, 14.0, 1.0));
  CHECK_FALSE(rare(0.0, 14.0, 1.0));
}

TEST_CASE("Ranking only the first columns gives the beginning of the whole ranking") {
  const std::vector<double> t{1, -3, 3, 0, 2, -2, 5};
  const auto whole = rank_by_t(t);
  for (std::size_t most = 0; most <= t.size() + 1; ++most) {
    const auto some = rank_by_t(t, most);
    REQUIRE(some.size() == std::min(most, t.size()));
    CHECK(std::equal(some.begin(), some.end(), whole.begin()));
  }
}

}  // namespace
}  // namespace weft::classifier::selection_test
