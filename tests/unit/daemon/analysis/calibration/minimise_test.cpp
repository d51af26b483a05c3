// The search within the unit cube. Without NLopt it returns `unsupported`.

#include <catch2/catch.hpp>

#include "daemon/analysis/calibration/minimise.hpp"
#include "tests/unit/daemon/analysis/calibration/fit_support.hpp"

namespace weft::daemon::calibration::minimise_test {

using namespace test;

namespace {

/// Minimum 0 at (0.75, 0.75).
double rosenbrock(std::span<const double> at) {
  const double u = 4 * at[0] - 2, v = 4 * at[1] - 2;
  return 100 * (100 * (v - u * u) * (v - u * u) + (1 - u) * (1 - u));
}

}  // namespace

TEST_CASE("Sobol's points are the published ones") {
  CHECK(sobol_point(1, 3) == std::vector<double>{0.5, 0.5, 0.5});
  CHECK(sobol_point(2, 3) == std::vector<double>{0.75, 0.25, 0.25});
  CHECK(sobol_point(3, 3) == std::vector<double>{0.25, 0.75, 0.75});
  CHECK(sobol_point(4, 3) == std::vector<double>{0.375, 0.375, 0.625});
}

TEST_CASE("A minimum is found inside and at the bounds, or NLopt is named") {
  const Cost cost = [](std::span<const double> x) {
    return 100 * ((x[0] - 0.3) * (x[0] - 0.3) + (x[1] - 1.4) * (x[1] - 1.4));
  };
  const auto found = minimise_from_many(cost, std::vector<double>{0.8, 0.1}, 3, 40);
  if (!has_nlopt()) {
    REQUIRE_FALSE(found);
    CHECK(found.error().code == Errc::unsupported);
    return;
  }
  REQUIRE(found);
  CHECK(found->at[0] == Approx(0.3).margin(0.01));
  CHECK(found->at[1] == Approx(1).margin(0.01));
  CHECK(found->evaluations <= 4 * 40);
}

TEST_CASE("A quadratic of three dimensions takes a model's points and few more") {
  if (lacks_nlopt()) return;
  const Cost cost = [](std::span<const double> x) {
    return 100 * ((x[0] - 0.3) * (x[0] - 0.3) + 2 * (x[1] - 0.6) * (x[1] - 0.6) +
                  0.5 * (x[2] - 0.45) * (x[2] - 0.45));
  };
  const auto found = minimise(cost, std::vector<double>{0.8, 0.1, 0.9}, 30);
  REQUIRE(found);
  CHECK(found->at[0] == Approx(0.3).margin(1e-3));
  CHECK(found->at[1] == Approx(0.6).margin(1e-3));
  CHECK(found->at[2] == Approx(0.45).margin(1e-3));
  CHECK(found->evaluations <= 30);
}

TEST_CASE("The end of Rosenbrock's valley is found from several starts") {
  if (lacks_nlopt()) return;
  constexpr std::size_t starts = 5, evaluations = 150;
  std::size_t calls = 0;
  const Cost cost = [&](std::span<const double> at) {
    ++calls;
    return rosenbrock(at);
  };
  const auto found = minimise_from_many(cost, std::vector<double>{0.2, 0.75}, starts, evaluations);
  REQUIRE(found);
  CHECK(found->at[0] == Approx(0.75).margin(0.02));
  CHECK(found->at[1] == Approx(0.75).margin(0.02));
  CHECK(found->value == rosenbrock(found->at));
  CHECK(found->evaluations == calls);
  CHECK(calls <= (starts + 1) * evaluations);
}

TEST_CASE("Two searches are equal to the last bit, and a limit is kept") {
  if (lacks_nlopt()) return;
  const std::vector<double> start{0.1, 0.9};
  const auto one = minimise(rosenbrock, start, 25), two = minimise(rosenbrock, start, 25);
  REQUIRE(one);
  REQUIRE(two);
  CHECK(one->at == two->at);
  CHECK(one->evaluations == two->evaluations);
  const auto single = minimise(rosenbrock, start, 1);
  REQUIRE(single);
  CHECK(single->evaluations == 1);
  CHECK(single->value <= rosenbrock(start));
}

TEST_CASE("One dimension is searched as well") {
  if (lacks_nlopt()) return;
  const Cost cost = [](std::span<const double> x) { return 100 * (x[0] - 0.4) * (x[0] - 0.4); };
  const auto found = minimise_from_many(cost, std::vector<double>{0.9}, 3, 40);
  REQUIRE(found);
  CHECK(found->at[0] == Approx(0.4).margin(0.02));
}

}  // namespace weft::daemon::calibration::minimise_test
