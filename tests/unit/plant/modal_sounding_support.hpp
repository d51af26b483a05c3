#pragma once
// Shared code of the tests of level L3.

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <vector>

#include "sim/plant/modal/vibration.hpp"
#include "tests/unit/plant/dynamic_support.hpp"

namespace weft::sim::test {

inline constexpr double two_pi = 2 * std::numbers::pi;
inline constexpr std::int64_t grid_ns = 3'072'000;  // a pad's conversion: not a multiple of the
                                                    // ticks

/// Ribs across x: one wave of pitch P and amplitude a.
inline HeightField ribs(double pitch_m, double amplitude_m) {
  SurfaceSpec spec;
  spec.warp_pitch_m = spec.weft_pitch_m = pitch_m;
  spec.height_rms_m = amplitude_m / std::numbers::sqrt2;
  spec.structure.lines = {{1, 0, 1, 0}};
  return HeightField(spec, 3);
}

/// A reading at every tick, without noise, quantum, low-pass and gravity; no asperities.
inline VibrationParams bare() {
  VibrationParams params;
  const ConverterParams open{params.step_ns, 0, 0, 1e6, 0};
  params.accelerometer->converter = params.microphone->converter = open;
  params.accelerometer->gravity_mps2 = {};
  params.rubbing.asperity_share = 0;
  return params;
}

struct Bench {
  ContactMaterial material = plain("felt");
  DynamicsParams dynamics = with_step(62.5e-6);
  VibrationParams vibration = bare();
  HeightField field;
  double skew_rad = 0;

  [[nodiscard]] DynamicContact contact() const {
    return DynamicContact(level_plate(), {}, material, dynamics);
  }
  [[nodiscard]] SoundingContact sounding(TimePoint start = {}) const {
    auto made = SoundingContact::make(contact(), vibration, field, skew_rad, 1, start);
    REQUIRE(made.has_value());
    return std::move(*made);
  }
  /// Stage height at which this fabric rests under about `load_n` at level L1.
  [[nodiscard]] double height_m(double load_n) const {
    const Mount mount;
    const double depth_m =
        material.law.lambda_m *
        std::log1p(load_n / (level_plate().face_area_m2() * material.law.pressure_pa));
    return plate_z - material.thickness_m + depth_m +
           (load_n - mount.weight_n()) / mount.stiffness_n_m;
  }
};

/// Amplitude of one frequency in evenly spaced values, with a Hann window.
inline double amplitude_at(const std::vector<double>& values, double turns_per_value) {
  std::complex<double> sum = 0;
  double weights = 0;
  const double n = static_cast<double>(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double at = static_cast<double>(i);
    const double weight = 1 - std::cos(two_pi * (at + 0.5) / n);
    weights += weight;
    sum += weight * values[i] * std::polar(1.0, -two_pi * turns_per_value * at);
  }
  return 2 * std::abs(sum) / weights;
}

inline std::vector<double> axis_of(const VibrationReadings& readings, std::size_t axis) {
  std::vector<double> all;
  for (const auto& r : readings.acceleration) all.push_back(r.acceleration_mps2[axis]);
  return all;
}

inline double rms(const std::vector<double>& values) {
  return std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0) /
                   static_cast<double>(values.size()));
}

/// Moves to `to` in steps of the pads' grid at a constant speed.
inline ContactState go(SoundingContact& sounding, ContactState state, const Pose& to,
                       double duration_s) {
  const Pose from = state.pose;
  const int steps = static_cast<int>(duration_s * 1e9 / static_cast<double>(grid_ns));
  for (int i = 1; i <= steps; ++i) {
    const double a = static_cast<double>(i) / steps;
    state = sounding.advance(state,
                             {.x_m = from.x_m + a * (to.x_m - from.x_m),
                              .y_m = from.y_m + a * (to.y_m - from.y_m),
                              .z_m = from.z_m + a * (to.z_m - from.z_m)},
                             Duration(grid_ns));
  }
  return state;
}

}  // namespace weft::sim::test
