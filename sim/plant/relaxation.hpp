#pragma once
// Stress relaxation of cloth: a Prony series (quasi-linear viscoelasticity),
//   F = F_e - sum q_i,   dq_i/dt = (g_i F_e - q_i)/tau_i,
// updated exactly for an F_e that is linear within the step. Source: docs/reference/plant.md,
// Contact law and Closed forms (3).

#include <array>
#include <cmath>
#include <cstddef>

#include "sim/plant/lanes.hpp"

namespace weft::sim {

// Rate-independent hysteresis of compression. The factor on the elastic force runs between 1
// (loading curve, which is what KES prints) and (1 - eta)/(1 + eta) (unloading), so that a whole
// cycle has the resilience RC. The passage between the two is smooth in s = indentation/lambda: a
// Maxwell-slip element with one length.

struct Hysteresis {
  double eta = 0;       ///< 0 switches it off
  double length = 0.3;  ///< change of s over which 1 - 1/e of a reversal is done [E]
};

/// The branch after s has moved by `moved`: +1 loading, -1 unloading. `retained` =
/// e^{-|moved|/length}; exact for any step.
WEFT_SIM_INLINE double branch_after(double branch, double moved, double retained) {
  const double target = moved > 0 ? 1 : -1;
  return target + (branch - target) * retained;
}

inline double branch_factor(double branch, double eta) {
  return (1 + eta * branch) / (1 + eta);
}

struct Relaxation {
  static constexpr std::size_t terms = 2;
  std::array<double, terms> share{};       ///< g_i, sum below 1; 0 switches a term off
  std::array<double, terms> time_s{1, 1};  ///< tau_i > 0
};

/// The memory of a series: relaxed force and the elastic force it was last told.
struct RelaxationState {
  std::array<double, Relaxation::terms> relaxed_n{};
  double elastic_n = 0;
};

/// The effect of one step on the force, linear in the elastic force at its end: F = gain F_e -
/// offset.
struct RelaxationStep {
  std::array<double, Relaxation::terms> decay{};     ///< e^{-dt/tau}
  std::array<double, Relaxation::terms> at_begin{};  ///< weight of F_e at the step's begin
  std::array<double, Relaxation::terms> at_end{};    ///< weight of F_e at the step's end
  double gain = 1;
  static constexpr double faded_n = 1e-300;

  /// `dt_s` = 0 is a jump of F_e: nothing relaxes.
  RelaxationStep(const Relaxation& relaxation, double dt_s) {
    for (std::size_t i = 0; i < Relaxation::terms; ++i) {
      const double x = dt_s / relaxation.time_s[i];
      const double decayed = -std::expm1(-x);
      const double average = x > 0 ? decayed / x : 1;  // mean of e^{-s} over the step
      decay[i] = 1 - decayed;
      at_end[i] = relaxation.share[i] * (1 - average);
      at_begin[i] = relaxation.share[i] * (average - decay[i]);
      gain -= at_end[i];
    }
  }

  [[nodiscard]] double offset_n(const RelaxationState& state) const {
    double sum = 0;
    for (std::size_t i = 0; i < Relaxation::terms; ++i)
      sum += decay[i] * state.relaxed_n[i] + at_begin[i] * state.elastic_n;
    return sum;
  }

  void advance(RelaxationState& state, double elastic_n) const {
    for (std::size_t i = 0; i < Relaxation::terms; ++i) {
      const double relaxed_n =
          decay[i] * state.relaxed_n[i] + at_begin[i] * state.elastic_n + at_end[i] * elastic_n;
      // A memory fades to zero and not into the denormals, where it would stay and cost.
      state.relaxed_n[i] = std::abs(relaxed_n) < faded_n ? 0 : relaxed_n;
    }
    state.elastic_n = elastic_n;
  }
};

}  // namespace weft::sim
