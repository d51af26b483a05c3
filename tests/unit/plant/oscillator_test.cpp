#include "sim/plant/modal/converter.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

namespace oscillator_test {

using namespace weft;
using namespace weft::sim;

namespace {

using Complex = std::complex<long double>;
const double not_a_number = std::numeric_limits<double>::quiet_NaN();
const double inf = std::numeric_limits<double>::infinity();

OscillatorStep step_of(const Oscillator& oscillator, double step_s) {
  const auto made = OscillatorStep::make(oscillator, step_s);
  REQUIRE(made.has_value());
  return *made;
}

Oscillator with_ratio(double stiffness_n_m, double ratio, double mass_kg = 0.2) {
  return {mass_kg, 2 * ratio * std::sqrt(stiffness_n_m * mass_kg), stiffness_n_m};
}

/// Free motion from (x0, v0) by the roots of the characteristic equation, which must be distinct.
long double free_x(const Oscillator& o, long double x0, long double v0, long double t) {
  const long double m = o.mass_kg, c = o.damping_n_s_m, k = o.stiffness_n_m;
  const Complex root = std::sqrt(Complex(c * c - 4 * m * k, 0));
  const Complex a = (-c + root) / (2 * m), b = (-c - root) / (2 * m);
  return ((v0 - b * x0) / (a - b) * std::exp(a * t) + (a * x0 - v0) / (a - b) * std::exp(b * t))
      .real();
}

/// Response from rest to f = f0 + f1 t.
long double ramp_x(const Oscillator& o, long double f0, long double f1, long double t) {
  const long double c = o.damping_n_s_m, k = o.stiffness_n_m;
  const long double at_0 = f0 / k - c * f1 / (k * k), slope = f1 / k;
  return at_0 + slope * t + free_x(o, -at_0, -slope, t);
}

/// Response from rest to f0 sin(w t).
long double sine_x(const Oscillator& o, long double f0, long double w, long double t) {
  const Complex dynamic(o.stiffness_n_m - o.mass_kg * w * w, o.damping_n_s_m * w);
  const auto at = [&](long double s) { return f0 * std::exp(Complex(0, w * s)) / dynamic; };
  return at(t).imag() + free_x(o, -at(0).imag(), -w * at(0).real(), t);
}

double energy(const Oscillator& o, const OscillatorState& s) {
  return 0.5 * (o.stiffness_n_m * s.x_m * s.x_m + o.mass_kg * s.v_mps * s.v_mps);
}

constexpr double ratios[] = {0, 1e-9, 0.01, 0.1, 0.7, 0.999, 1.001, 1.1, 2, 10, 300};

}  // namespace

TEST_CASE("A step of force is answered in closed form at every damping") {
  for (const double ratio : ratios)
    for (const double h : {1e-6, 1e-3, 5e-3, 50e-3}) {
      CAPTURE(ratio, h);
      const Oscillator o = with_ratio(1e4, ratio);
      const OscillatorStep step = step_of(o, h);
      OscillatorState state;
      for (int i = 1; i <= 40; ++i) {
        state = step.advance(state, 5, 5);
        REQUIRE(state.x_m ==
                Approx(static_cast<double>(ramp_x(o, 5, 0, i * static_cast<long double>(h))))
                    .epsilon(1e-11)
                    .margin(1e-17));
      }
    }
}

TEST_CASE("A ramp of force is answered in closed form at every damping") {
  for (const double ratio : ratios)
    for (const double h : {1e-5, 1e-3, 50e-3}) {
      CAPTURE(ratio, h);
      const Oscillator o = with_ratio(1e4, ratio);
      const OscillatorStep step = step_of(o, h);
      OscillatorState state;
      for (int i = 1; i <= 40; ++i) {
        state = step.advance(state, 3 + 200 * h * (i - 1), 3 + 200 * h * i);
        REQUIRE(state.x_m ==
                Approx(static_cast<double>(ramp_x(o, 3, 200, i * static_cast<long double>(h))))
                    .epsilon(1e-10)
                    .margin(1e-16));
      }
    }
}

TEST_CASE("Critical damping is the limit from both sides") {
  const double w = std::sqrt(1e4 / 0.2);
  for (const double h : {1e-6, 1e-3, 50e-3}) {
    const OscillatorState state =
        step_of(with_ratio(1e4, 1), h).advance({1e-3, 0.02}, 0, 0);  // (x0 + (v0 + w x0) t) e^-wt
    const double x = (1e-3 + (0.02 + w * 1e-3) * h) * std::exp(-w * h);
    CHECK(state.x_m == Approx(x).epsilon(1e-12));
  }
}

TEST_CASE("A sine sampled finely is followed with the error of its straight pieces") {
  for (const double ratio : {0.0, 0.1, 1.001, 3.0}) {
    const Oscillator o = with_ratio(1e4, ratio);
    const double w = 150;
    double last = 1;
    for (const double h : {4e-4, 2e-4, 1e-4}) {
      const OscillatorStep step = step_of(o, h);
      OscillatorState state;
      double worst = 0;
      for (int i = 1; i * h <= 0.2; ++i) {
        state = step.advance(state, 2 * std::sin(w * h * (i - 1)), 2 * std::sin(w * h * i));
        const auto exact = static_cast<double>(sine_x(o, 2, w, i * static_cast<long double>(h)));
        worst = std::max(worst, std::abs(state.x_m - exact) / (2 / o.stiffness_n_m));
      }
      CHECK(worst < 0.28 * last);  // second order, only from the sampling of the sine
      last = worst;
    }
    CHECK(last < 2e-4);
  }
}

TEST_CASE("Without a spring a mass flies, is braked and is pushed") {
  for (const double h : {1e-6, 1e-3, 0.05, 10.0}) {
    const OscillatorState flown = step_of({2, 0, 0}, h).advance({1, 3}, 4, 8);
    CHECK(flown.x_m == Approx(1 + 3 * h + h * h + h * h / 3).epsilon(1e-14));
    CHECK(flown.v_mps == Approx(3 + 3 * h).epsilon(1e-14));
    for (const double c : {1e-9, 2.0, 1e6}) {
      const OscillatorState braked = step_of({2, c, 0}, h).advance({1, 3}, 0, 0);
      CHECK(braked.x_m == Approx(1 - 3 * 2 / c * std::expm1(-c / 2 * h)).epsilon(1e-13));
      CHECK(braked.v_mps == Approx(3 * std::exp(-c / 2 * h)).epsilon(1e-13).margin(1e-300));
    }
  }
}

TEST_CASE("Half a step twice is one step, in every regime") {
  for (const double k : {0.0, 1e-6, 1e1, 1e4, 1e8})
    for (const double c : {0.0, 1e-6, 1.0, 89.44271909999159, 1e4})
      for (const double h : {1e-6, 1e-4, 3e-3, 50e-3}) {
        CAPTURE(k, c, h);
        const OscillatorState whole = step_of({0.2, c, k}, h).advance({1e-3, -0.5}, 2, 6);
        const OscillatorStep half = step_of({0.2, c, k}, h / 2);
        const OscillatorState two = half.advance(half.advance({1e-3, -0.5}, 2, 4), 4, 6);
        CHECK(whole.x_m == Approx(two.x_m).epsilon(1e-11).margin(1e-15));
        CHECK(whole.v_mps == Approx(two.v_mps).epsilon(1e-10).margin(1e-12));
      }
}

TEST_CASE("Ten million steps without damping keep the energy to 1e-9") {
  for (const auto& [stiffness, h] : {std::pair{1e4, 1e-3}, {1e4, 1e-6}, {1e8, 50e-3}}) {
    CAPTURE(stiffness, h);
    const Oscillator o{0.2, 0, stiffness};
    const OscillatorStep step = step_of(o, h);
    OscillatorState state{1e-3, 0};
    const double at_first = energy(o, state);
    for (int i = 0; i < 10'000'000; ++i) state = step.advance(state, 0, 0);
    CHECK(std::abs(energy(o, state) / at_first - 1) < 1e-9);
  }
}

TEST_CASE(
    "Stiffness 1e1 to 1e8 and steps 1 us to 50 ms: undamped motion keeps amplitude and phase") {
  for (double stiffness = 1e1; stiffness < 2e8; stiffness *= 10)
    for (const double h : {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 50e-3}) {
      CAPTURE(stiffness, h);
      const Oscillator o{0.2, 0, stiffness};
      const OscillatorStep step = step_of(o, h);
      OscillatorState state{1e-3, 0};
      for (int i = 0; i < 20'000; ++i) state = step.advance(state, 0, 0);
      CHECK(energy(o, state) / energy(o, {1e-3, 0}) == Approx(1).epsilon(1e-11));
      const auto phase = std::sqrt(static_cast<long double>(stiffness) / 0.2) * 20'000 * h;
      CHECK(state.x_m == Approx(static_cast<double>(1e-3L * std::cos(phase))).margin(1e-11));
    }
}

TEST_CASE("A bounce gives back e^(-pi zeta/sqrt(1 - zeta^2)) of the speed") {
  for (const double ratio : {0.0, 0.05, 0.3, 0.9}) {
    const Oscillator o = with_ratio(1e5, ratio);
    const double damped = std::sqrt(1e5 / 0.2 * (1 - ratio * ratio));
    const OscillatorStep step = step_of(o, std::numbers::pi / damped / 64);
    OscillatorState state{0, -1};
    for (int i = 0; i < 64; ++i) state = step.advance(state, 0, 0);
    CHECK(state.x_m == Approx(0).margin(1e-15));
    const double restitution = std::exp(-std::numbers::pi * ratio / std::sqrt(1 - ratio * ratio));
    CHECK(state.v_mps == Approx(restitution).epsilon(1e-12));
  }
}

TEST_CASE("Oscillators that cannot be are refused; the extremes that can be stay finite") {
  for (const double bad : {not_a_number, inf, -inf, -1.0, 1e308}) {
    CHECK_FALSE(OscillatorStep::make({bad, 1, 1}, 1e-3).has_value());
    CHECK_FALSE(OscillatorStep::make({1, bad, 1}, 1e-3).has_value());
    CHECK_FALSE(OscillatorStep::make({1, 1, bad}, 1e-3).has_value());
    CHECK_FALSE(OscillatorStep::make({1, 1, 1}, bad).has_value());
  }
  CHECK_FALSE(OscillatorStep::make({0, 1, 1}, 1e-3).has_value());
  const auto refused = OscillatorStep::make({1, 1, not_a_number}, 1e-3);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == Errc::range);
  CHECK(refused.error().where == "stiffness_n_m");
  CHECK(refused.error().expected == "0 to 1e15");
  CHECK(refused.error().got == "nan");
  for (const double k : {0.0, 5e-324, 1e-300, 1e8, 1e15})
    for (const double c : {0.0, 5e-324, 1e-300, 1e3, 1e5})
      for (const double h : {0.0, 5e-324, 1e-12, 1e-6, 1.0}) {
        const OscillatorState state = step_of({0.2, c, k}, h).advance({1e-3, 1}, 10, -10);
        CHECK(std::isfinite(state.x_m));
        CHECK(std::isfinite(state.v_mps));
        if (h == 0) CHECK(state.x_m == 1e-3);
      }
}

}  // namespace oscillator_test
