#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/unit/plant/modal_sounding_support.hpp"

namespace modal_sounding_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::sim::test;

TEST_CASE("A texture of pitch P passed at v gives its line at v/P in the accelerometer") {
  Bench bench;
  bench.material.friction.coefficient = 0;
  bench.vibration.microphone.reset();
  const double pitch_m = 1.25e-3, height_m = 2e-6;
  bench.field = ribs(pitch_m, height_m);
  const double z_m = bench.height_m(5);
  for (const double speed_mps : {25e-3, 50e-3}) {
    SoundingContact sounding = bench.sounding();
    ContactState state = hanging(bench.material, z_m - 1e-3);
    state = go(sounding, state, {.z_m = z_m}, 0.5);
    state = go(sounding, state, {.z_m = z_m}, 1.5);  // the vibration of the contact decays
    state = go(sounding, state, {.x_m = 0.5 * speed_mps, .z_m = z_m}, 0.5);
    CHECK(state.normal_n == Approx(5).epsilon(0.02));
    static_cast<void>(sounding.take());
    state = go(sounding, state, {.x_m = 2.5 * speed_mps, .z_m = z_m}, 2);
    const std::vector<double> z = axis_of(sounding.take(), 2);
    const double line = speed_mps / pitch_m * 62.5e-6;
    const double received = amplitude_at(z, line);
    // Stiffness of the face times the mean of the ribs under it, through the arm's first bending.
    const double stiffness =
        (state.normal_n + level_plate().face_area_m2() * bench.material.law.pressure_pa) /
        bench.material.law.lambda_m;
    const double k = two_pi / pitch_m * level_plate().face_half_width_m;
    const double force_n = stiffness * height_m * std::abs(std::sin(k) / k);
    const double w = two_pi * speed_mps / pitch_m;
    const ArmParams& arm = bench.vibration.accelerometer->arm;
    double gain = 0;
    for (const double overtone : {1.0, 6.26689, 17.54748, 34.38606})
      if (const double natural = two_pi * arm.fundamental_hz[2] * overtone; natural < two_pi * 7200)
        gain += 4 / arm.mass_kg * w * w / (natural * natural - w * w);
    CAPTURE(speed_mps);
    CHECK(received == Approx(force_n * gain).epsilon(0.02));
    CHECK(amplitude_at(z, 1.3 * line) < 0.01 * received);
    CHECK(amplitude_at(z, 0.7 * line) < 0.01 * received);
  }
}

TEST_CASE("A touch rings at the arm's first mode and decays with its damping") {
  Bench bench;
  bench.vibration.microphone.reset();
  bench.material.friction.coefficient = 0;
  const double z_m = plate_z - bench.material.thickness_m - 0.2e-3;
  SoundingContact sounding = bench.sounding();
  // A blow: the probe falls from its stop for an instant and is lifted again.
  ContactState state = hanging(bench.material, z_m);
  state = go(sounding, state, {.z_m = z_m + 1.2e-3}, 0.02);
  state = go(sounding, state, {.z_m = z_m - 1e-3}, 0.02);
  REQUIRE(state.normal_n == 0);
  state = go(sounding, state, {.z_m = z_m - 1e-3}, 0.05);  // the overtones decay first
  static_cast<void>(sounding.take());
  state = go(sounding, state, {.z_m = z_m - 1e-3}, 0.5);
  REQUIRE(state.normal_n == 0);
  const std::vector<double> z = axis_of(sounding.take(), 2);
  const ArmParams arm;
  const double natural_hz = arm.fundamental_hz[2], zeta = arm.damping_ratio;
  // Zero crossings give the frequency, successive maxima the decay.
  std::vector<double> crossings_s, crests;
  double crest = 0;
  for (std::size_t i = 1; i < z.size(); ++i) {
    crest = std::max(crest, z[i]);
    if (!(z[i - 1] < 0 && z[i] >= 0)) continue;
    crossings_s.push_back(62.5e-6 * (static_cast<double>(i) - z[i] / (z[i] - z[i - 1])));
    if (crossings_s.size() > 1) crests.push_back(crest);
    crest = 0;
  }
  REQUIRE(crests.size() > 60);
  const double periods = static_cast<double>(crossings_s.size() - 1);
  const double damped_hz = natural_hz * std::sqrt(1 - zeta * zeta);
  CHECK(periods / (crossings_s.back() - crossings_s.front()) == Approx(damped_hz).epsilon(1e-3));
  const double per_period = std::exp(-two_pi * zeta / std::sqrt(1 - zeta * zeta));
  CHECK(std::pow(crests[60] / crests[10], 1.0 / 50) == Approx(per_period).epsilon(2e-3));
}

TEST_CASE("At rest on the cloth there is silence, off it too") {
  Bench bench;
  bench.vibration.rubbing.asperity_share = 2e-3;
  bench.field = ribs(1.25e-3, 4e-6);
  const double z_m = bench.height_m(5);
  SoundingContact sounding = bench.sounding();
  ContactState state = hanging(bench.material, z_m - 4e-3);
  state = go(sounding, state, {.z_m = z_m - 4e-3}, 0.1);
  const VibrationReadings off = sounding.take();
  CHECK(rms(axis_of(off, 2)) < 1e-12);
  state = go(sounding, state, {.z_m = z_m}, 0.5);
  const VibrationReadings touch = sounding.take();
  state = go(sounding, state, {.z_m = z_m}, 5);
  static_cast<void>(sounding.take());
  state = go(sounding, state, {.z_m = z_m}, 0.5);
  const VibrationReadings still = sounding.take();
  for (std::size_t axis = 0; axis < 3; ++axis)
    CHECK(rms(axis_of(still, axis)) < 1e-6 * rms(axis_of(touch, 2)));
  double loudest = 0;
  for (const SoundReading& r : still.sound) loudest = std::max(loudest, std::abs(r.pressure_pa));
  CHECK(loudest < 1e-6);
}

TEST_CASE("The stick-slip cycle sounds: lines at its multiples, and only there") {
  Bench bench;
  bench.vibration.microphone.reset();
  bench.material.friction = {.coefficient = 0.2, .exponent = 1, .bristle_length_m = 10e-6};
  bench.dynamics.static_ratio = 1.3;
  bench.dynamics.friction_speed_mps = 1;  // the coefficient is the kinetic one
  const auto received = [&](double lateral_stiffness_n_m) {
    bench.dynamics.lateral_stiffness_n_m = lateral_stiffness_n_m;
    const double z_m = bench.height_m(5), speed_mps = 2e-3;  // F_C = 1 N, as in lugre_test.cpp
    SoundingContact sounding = bench.sounding();
    ContactState state = hanging(bench.material, z_m - 1e-3);
    state = go(sounding, state, {.z_m = z_m}, 0.5);
    state = go(sounding, state, {.y_m = 2 * speed_mps, .z_m = z_m}, 2);
    static_cast<void>(sounding.take());
    static_cast<void>(go(sounding, state, {.y_m = 6 * speed_mps, .z_m = z_m}, 4));
    return axis_of(sounding.take(), 1);
  };
  const std::vector<double> cycle = received(1e4), smooth = received(1e6);
  // On this guide the probe slips 24.3 times a second (lugre_test.cpp, Runge-Kutta), and every
  // second slip is longer: the cycle's own frequency is half of that.
  const auto comb = [&](double fundamental_hz, double shift) {
    double squares = 0;
    for (int n = 2; n <= 12; ++n) {
      const double a = amplitude_at(cycle, (n + shift) * fundamental_hz * 62.5e-6);
      squares += a * a;
    }
    return std::sqrt(squares);
  };
  double best_hz = 0, best = 0;
  for (double hz = 11; hz < 14; hz += 0.02)
    if (const double a = comb(hz, 0); a > best) best = a, best_hz = hz;
  CHECK(best_hz == Approx(24.3 / 2).margin(0.1));
  CHECK(best > 20 * comb(best_hz, 0.5));
  CHECK(rms(smooth) < 0.02 * rms(cycle));
}

TEST_CASE("Skewed yarns sound at the pitch along the path") {
  Bench bench;
  bench.vibration.microphone.reset();
  bench.material.friction.coefficient = 0;
  const double pitch_m = 1.25e-3, speed_mps = 50e-3;
  bench.field = ribs(pitch_m, 4e-6);
  bench.skew_rad = two_pi / 6;  // 60 degrees: along x the pitch is twice as long
  const double z_m = bench.height_m(5);
  SoundingContact sounding = bench.sounding();
  ContactState state = hanging(bench.material, z_m - 1e-3);
  state = go(sounding, state, {.z_m = z_m}, 0.5);
  state = go(sounding, state, {.x_m = speed_mps, .z_m = z_m}, 1);
  static_cast<void>(sounding.take());
  static_cast<void>(go(sounding, state, {.x_m = 3 * speed_mps, .z_m = z_m}, 2));
  const std::vector<double> z = axis_of(sounding.take(), 2);
  const double line = speed_mps / pitch_m * 62.5e-6;
  CHECK(amplitude_at(z, line / 2) > 100 * amplitude_at(z, line));
}

}  // namespace modal_sounding_test
