#pragma once
// An exactly advanced oscillator, and a converter from a quantity in every step to the readings of
// one sensor axis: low-pass, sampling at the sensor's own period, noise, range, quantum.

#include <array>
#include <cstdint>
#include <optional>

#include "protocols/base/result.hpp"
#include "sim/plant/random.hpp"

namespace weft::sim {

/// m x'' + c x' + k x = f(t), advanced exactly for an f that is linear within the step, for any
/// step, damping or stiffness: under-, critically and over-damped, undamped, and without a spring.
/// Source: docs/reference/plant.md, Integrators and Closed forms (1, 10).
struct Oscillator {
  double mass_kg = 1;
  double damping_n_s_m = 0;
  double stiffness_n_m = 0;

  /// The same from a natural frequency and a damping ratio.
  static Oscillator resonance(double mass_kg, double angular_rad_s, double damping_ratio) {
    return {mass_kg, 2 * damping_ratio * angular_rad_s * mass_kg,
            mass_kg * angular_rad_s * angular_rad_s};
  }
};

struct OscillatorState {
  double x_m = 0;
  double v_mps = 0;
};

/// One step's coefficients, rounded once from a wider type. An undamped oscillator then changes
/// only by the rounding of its state, about 1e-16 of the energy per step.
class OscillatorStep {
 public:
  /// Errors: range, unless mass 1e-12 to 1e9 kg, damping 0 to 1e12 N s/m, stiffness 0 to 1e15 N/m,
  /// step 0 to 1e6 s and step times natural frequency and damping rate below 1e9.
  static Result<OscillatorStep> make(const Oscillator& oscillator, double step_s);

  /// The state a step later, with a force that changes linearly from `begin_n` to `end_n`.
  [[nodiscard]] OscillatorState advance(const OscillatorState& from, double begin_n,
                                        double end_n) const {
    const auto row = [&](const Row& r) {
      return (r.x * from.x_m + r.v * from.v_mps) + (r.begin * begin_n + r.end * end_n);
    };
    return {row(x_), row(v_)};
  }

 private:
  struct Row {
    double x = 0, v = 0;        // weights of the state
    double begin = 0, end = 0;  // weights of the force
  };
  Row x_, v_;
};

/// Sampling of one sensor's converter. Periods are whole numbers of the vibration's steps.
struct ConverterParams {
  std::int64_t period_ns = 0;
  double bandwidth_hz = 0;  ///< of a fourth-order Butterworth low-pass before sampling; 0: none
  double noise = 0;         ///< rms, in the sensor's unit
  double range = 0;         ///< readings are limited to +- this
  double quantum = 0;       ///< step of a reading; 0: none
};

/// Fourth-order Butterworth: two resonances, stepped exactly. Unit gain at zero frequency.
class LowPass {
 public:
  /// Errors: as OscillatorStep::make.
  static Result<LowPass> make(double bandwidth_hz, double step_s);
  double advance(double value);

 private:
  struct Section {
    OscillatorStep step;
    double square = 0;  // of the angular frequency
    OscillatorState state;
    double last = 0;
  };
  std::array<std::optional<Section>, 2> sections_;
};

/// One sensor's axis: low-pass, noise, range and quantum.
class Converter {
 public:
  /// Errors: range, with the name of the field. Readings are due at multiples of the period; the
  /// converter starts at the end of step `first_step` >= 0.
  static Result<Converter> make(const ConverterParams& params, std::int64_t step_ns,
                                std::uint64_t seed, std::int64_t first_step = 0);
  /// A reading if one is due at the end of this step; `offset` is a constant since time zero.
  std::optional<double> advance(double value, double offset = 0);

 private:
  Converter(const ConverterParams& params, std::int64_t steps, std::uint64_t seed)
      : params_(params), steps_(steps), noise_(seed) {}

  ConverterParams params_;
  std::int64_t steps_;
  std::int64_t left_ = 0;
  std::optional<LowPass> low_pass_;
  Random noise_;
};

}  // namespace weft::sim
