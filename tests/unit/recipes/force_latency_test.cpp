#include "recipes/control/force_latency.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

namespace force_latency_test {

using weft::recipes::ForceLatency;

namespace {

constexpr double cycle_s = 0.01;

/// A stage that oscillates by some micrometres, over a fabric of 2e4 N/m, with readings delayed by
/// `latency_s`.
double measured_s(double latency_s, double amplitude_m, double noise_n) {
  ForceLatency latency(cycle_s);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, noise_n);
  const auto z_m = [amplitude_m](double t) {
    return amplitude_m * (std::sin(2 * M_PI * 0.9 * t) + 0.5 * std::sin(2 * M_PI * 2.3 * t));
  };
  for (int i = 0; i < 700; ++i) {
    const double t = i * cycle_s;
    latency.add(z_m(t), 2e4 * z_m(t - latency_s) + noise(random));
  }
  return latency.estimate_s().value_or(-1);
}

}  // namespace

TEST_CASE("The lag of the force behind the stage is its latency") {
  for (const double latency_s : {0.0, 0.03, 0.05, 0.1, 0.2, 0.4})
    CHECK(measured_s(latency_s, 50e-6, 0.005) == Approx(latency_s).margin(cycle_s / 2));
}

TEST_CASE("Without motion, and of a force that does not follow it, no latency is known") {
  CHECK(measured_s(0.1, 1e-9, 0.005) == -1);
  CHECK(measured_s(0.1, 1e-6, 1.0) == -1);
  ForceLatency latency(cycle_s);
  for (int i = 0; i < 20; ++i) latency.add(1e-3 * i, i);
  CHECK_FALSE(latency.estimate_s().has_value());
}

}  // namespace force_latency_test
