#pragma once
// m x'' + c x' + k x = f(t), advanced exactly for an f that is linear within the step, at any step,
// damping or stiffness: under-, critically and over-damped, undamped, and without a spring.
// Source: docs/reference/plant.md, Integrators and Closed forms (1, 10).

#include "protocols/base/result.hpp"

namespace weft::sim {

struct Oscillator {
  double mass_kg = 1;
  double damping_n_s_m = 0;
  double stiffness_n_m = 0;

  /// With a natural frequency and a damping ratio instead.
  static Oscillator resonance(double mass_kg, double angular_rad_s, double damping_ratio) {
    return {mass_kg, 2 * damping_ratio * angular_rad_s * mass_kg,
            mass_kg * angular_rad_s * angular_rad_s};
  }
};

struct OscillatorState {
  double x_m = 0;
  double v_mps = 0;
};

/// One step's coefficients, rounded once from a wider type; what an undamped oscillator gains or
/// loses then is the rounding of its state, about 1e-16 of the energy per step.
class OscillatorStep {
 public:
  /// Errors: range, unless mass 1e-12 to 1e9 kg, damping 0 to 1e12 N s/m, stiffness 0 to 1e15 N/m,
  /// step 0 to 1e6 s and step times natural frequency and damping rate below 1e9.
  static Result<OscillatorStep> make(const Oscillator& oscillator, double step_s);

  /// The state a step later, the force going from `begin_n` to `end_n`.
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

}  // namespace weft::sim
