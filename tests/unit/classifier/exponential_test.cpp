#include "classifier/learn/svm_solver.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace exponential_test {

using weft::classifier::exp_of_negative;

TEST_CASE("exp(-factor x) is within two units in the last place over the whole range") {
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<double> exponent(-12.0, 2.8);
  for (std::size_t round = 0; round < 2000; ++round) {
    std::vector<double> x(1 + round % 9);
    for (double& v : x) v = std::pow(10.0, exponent(engine));
    std::vector<double> y = x;
    exp_of_negative(y, 0.75);
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double expected = std::exp(-0.75 * x[i]);
      CHECK(std::abs(y[i] - expected) <= 2 * std::numeric_limits<double>::epsilon() * expected);
    }
  }
}

TEST_CASE("exp of the ends: exactly 1, exactly 0, NaN stays NaN") {
  const double infinity = std::numeric_limits<double>::infinity();
  std::vector<double> x{0.0, 5e-324, 708.0, 1e308, infinity, std::nan("")};
  exp_of_negative(x, 1.0);
  CHECK(x[0] == 1.0);
  CHECK(x[1] == 1.0);
  CHECK(x[2] == 0.0);
  CHECK(x[3] == 0.0);
  CHECK(x[4] == 0.0);
  CHECK(std::isnan(x[5]));
  exp_of_negative({}, 1.0);
}

}  // namespace exponential_test
