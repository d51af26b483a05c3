// Fractions of a factorial compared with designs known to be the best.

#include "recipes/engine/sweep.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <utility>

namespace d_optimal_test {

using namespace weft::recipes;

namespace {

Factor factor(FactorKind kind, std::vector<double> values) {
  return {kind, std::move(values), {}};
}

/// |X'X / rows| by Gauss' elimination.
double information(const std::vector<std::vector<double>>& rows,
                   const std::vector<std::size_t>& chosen) {
  const std::size_t p = rows.front().size();
  std::vector<std::vector<double>> m(p, std::vector<double>(p, 0.0));
  for (const std::size_t r : chosen)
    for (std::size_t i = 0; i < p; ++i)
      for (std::size_t k = 0; k < p; ++k)
        m[i][k] += rows[r][i] * rows[r][k] / static_cast<double>(chosen.size());
  double product = 1;
  for (std::size_t i = 0; i < p; ++i) {
    product *= m[i][i];
    if (std::abs(m[i][i]) < 1e-12) return 0;
    for (std::size_t below = i + 1; below < p; ++below)
      for (std::size_t k = p; k-- > i;) m[below][k] -= m[below][i] / m[i][i] * m[i][k];
  }
  return product;
}

}  // namespace

TEST_CASE("The terms of a model are its constant, main effects, products and squares") {
  const std::vector<Factor> factors{factor(FactorKind::force, {1, 2, 5}),
                                    factor(FactorKind::speed, {1, 3}),
                                    factor(FactorKind::press, {4})};
  const auto linear = model_rows(factors, SweepModel::linear);
  CHECK(linear.size() == 6);
  CHECK(linear[0] == std::vector<double>{1, -1, -1});
  CHECK(linear[3] == std::vector<double>{1, -0.5, 1});
  const auto quadratic = model_rows(factors, SweepModel::quadratic);
  // force and speed, force squared, force times speed
  CHECK(quadratic[3] == std::vector<double>{1, -0.5, 1, 0.25, -0.5});
}

TEST_CASE("Half of 2 x 2 x 2 is the regular half fraction, as good as the whole for main effects") {
  const std::vector<Factor> factors{factor(FactorKind::force, {1, 2}),
                                    factor(FactorKind::speed, {1, 2}),
                                    factor(FactorKind::press, {1, 2})};
  const auto rows = model_rows(factors, SweepModel::linear);
  const Subset half = d_optimal(rows, 4);
  REQUIRE(half.rows.size() == 4);
  CHECK(half.d_efficiency == Approx(1));
  // the product of all three columns is the same in all its runs
  for (const std::size_t r : half.rows)
    CHECK(rows[r][1] * rows[r][2] * rows[r][3] ==
          rows[half.rows[0]][1] * rows[half.rows[0]][2] * rows[half.rows[0]][3]);
}

TEST_CASE("Six and seven of 3 x 3 cells for a quadratic model are as good as any") {
  const std::vector<Factor> factors{factor(FactorKind::force, {0, 1, 2}),
                                    factor(FactorKind::speed, {0, 1, 2})};
  const auto rows = model_rows(factors, SweepModel::quadratic);
  const std::vector<std::size_t> all{0, 1, 2, 3, 4, 5, 6, 7, 8};
  for (const std::size_t count : {6U, 7U}) {
    const Subset found = d_optimal(rows, count);
    REQUIRE(found.rows.size() == count);
    double best = 0;
    for (unsigned mask = 0; mask < 512; ++mask) {
      std::vector<std::size_t> some;
      for (std::size_t i = 0; i < 9; ++i)
        if ((mask >> i & 1) != 0) some.push_back(i);
      if (some.size() == count) best = std::max(best, information(rows, some));
    }
    CHECK(information(rows, found.rows) == Approx(best));
    CHECK(found.d_efficiency == Approx(std::pow(best / information(rows, all), 1.0 / 6)));
  }
}

}  // namespace d_optimal_test
