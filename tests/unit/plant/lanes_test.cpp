#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "sim/plant/lanes.hpp"
#include "sim/plant/random.hpp"

namespace lanes_test {

using namespace weft::sim;

namespace {

constexpr double ulp = 0x1p-52;

/// Largest error of `value` against `truth`, both functions of x, over arguments from `draw`,
/// scaled by the truth if `relative`.
template <class Value, class Truth, class Draw>
double worst(Value value, Truth truth, Draw draw, bool relative) {
  double error = 0;
  for (int i = 0; i < 50'000; ++i) {
    double x[] = {draw(), draw(), draw(), draw()}, y[simd::width];
    value(x, y);
    for (std::size_t k = 0; k < simd::width; ++k) {
      const long double t = truth(static_cast<long double>(x[k]));
      const long double off = std::abs(static_cast<long double>(y[k]) - t);
      error = std::max(error, static_cast<double>(relative ? off / std::abs(t) : off));
    }
  }
  return error;
}

}  // namespace

TEST_CASE("exponentials and logarithms of lanes are right to a few units of the last place") {
  Random random(1);
  const auto exp = [](const double* x, double* y) { simd::store(y, simd::exp(simd::load(x))); };
  const auto log = [](const double* x, double* y) { simd::store(y, simd::log(simd::load(x))); };
  const auto exp_truth = [](long double x) { return std::exp(x); };
  const auto log_truth = [](long double x) { return std::log(x); };
  CHECK(worst(
            exp, exp_truth, [&] { return random.uniform(-700, 700); }, true) < 1.5 * ulp);
  CHECK(worst(
            exp, exp_truth, [&] { return random.uniform(-1, 1); }, true) < 1.5 * ulp);
  CHECK(worst(
            log, log_truth, [&] { return std::exp(random.uniform(-700, 700)); }, true) < 1.5 * ulp);
  CHECK(worst(
            log, log_truth, [&] { return random.uniform(0.5, 2); }, true) < 1.5 * ulp);
  const simd::Lanes ends = simd::exp(simd::Lanes{0, 1e308, -1e308, -0.0});
  CHECK(ends[0] == 1);
  CHECK(ends[1] == simd::exp(simd::all(700))[0]);
  CHECK(std::isfinite(ends[1]));
  CHECK(ends[2] == Approx(std::exp(-700.0)));
  CHECK(ends[3] == 1);
  CHECK(simd::log(simd::all(1))[0] == 0);
}

TEST_CASE("sines and cosines of turns are those of the angle") {
  Random random(2);
  constexpr long double two_pi = 2 * std::numbers::pi_v<long double>;
  const auto cos = [](const double* x, double* y) {
    simd::store(y, simd::cosine_of_turns(simd::load(x)));
  };
  const auto sin = [](const double* x, double* y) {
    simd::store(y, simd::turned(simd::load(x)).sine);
  };
  const auto draw = [&] { return random.uniform(-3, 3); };
  const auto cos_truth = [](long double x) { return std::cos(two_pi * x); };
  const auto sin_truth = [](long double x) { return std::sin(two_pi * x); };
  CHECK(worst(cos, cos_truth, draw, false) < 3 * ulp);
  CHECK(worst(sin, sin_truth, draw, false) < 3 * ulp);
  const auto both = [](const double* x, double* y) {
    simd::store(y, simd::turned(simd::load(x)).cosine);
  };
  CHECK(worst(both, cos_truth, draw, false) < 3 * ulp);
  const simd::Lanes quarters{0, 0.25, 0.5, 0.75};
  for (std::size_t k = 0; k < simd::width; ++k) {
    CHECK(simd::cosine_of_turns(quarters)[k] ==
          Approx(std::cos(std::numbers::pi / 2 * static_cast<double>(k))).margin(ulp));
    CHECK(simd::turned(quarters).sine[k] ==
          Approx(std::sin(std::numbers::pi / 2 * static_cast<double>(k))).margin(ulp));
  }
}

TEST_CASE("square roots of lanes are the processor's") {
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const simd::Lanes x{random.uniform(), 1e300 * random.uniform(), 1e-300 * random.uniform(), 0};
    for (std::size_t k = 0; k < simd::width; ++k) CHECK(simd::sqrt(x)[k] == std::sqrt(x[k]));
  }
}

}  // namespace lanes_test
