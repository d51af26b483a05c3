#pragma once
// The laws of a fabric: hysteresis, relaxation, friction and compression. Compression follows from
// the KES-FB3 values in textile tables. Source: docs/reference/plant.md, Contact law.

#include <array>
#include <cmath>
#include <cstddef>

#include "protocols/base/result.hpp"
#include "sim/plant/lanes.hpp"
#include "sim/plant/near.hpp"

namespace weft::sim {

/// Rate-independent hysteresis of compression. The factor on the elastic force is between 1
/// (loading curve, as printed by KES) and (1 - eta)/(1 + eta) (unloading). A whole cycle then has
/// the resilience RC. The transition is smooth in s = indentation/lambda: a Maxwell-slip element
/// with one length.
struct Hysteresis {
  double eta = 0;       ///< 0: no hysteresis
  double length = 0.3;  ///< change of s for 1 - 1/e of a reversal [E]
};

/// The branch after a change `moved` of s: +1 loading, -1 unloading. `retained` =
/// e^{-|moved|/length}; exact for any step.
WEFT_SIM_INLINE double branch_after(double branch, double moved, double retained) {
  const double target = moved > 0 ? 1 : -1;
  return target + (branch - target) * retained;
}

inline double branch_factor(double branch, double eta) {
  return (1 + eta * branch) / (1 + eta);
}

/// Stress relaxation of fabric: a Prony series (quasi-linear viscoelasticity),
///   F = F_e - sum q_i,   dq_i/dt = (g_i F_e - q_i)/tau_i,
/// updated exactly for an F_e that is linear within the step. Source: Closed forms (3) there.
struct Relaxation {
  static constexpr std::size_t terms = 2;
  std::array<double, terms> share{};       ///< g_i, sum below 1; 0: no such term
  std::array<double, terms> time_s{1, 1};  ///< tau_i > 0

  [[nodiscard]] bool on() const { return share != std::array<double, terms>{}; }
};

/// State of a series: the relaxed forces and the last elastic force.
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

  /// `dt_s` = 0 is a jump of F_e without relaxation.
  RelaxationStep(const Relaxation& relaxation, double dt_s) {
    if (relaxation.on()) weigh(relaxation, dt_s);
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
      // Set tiny values to zero: denormals would persist and be slow.
      state.relaxed_n[i] = std::abs(relaxed_n) < faded_n ? 0 : relaxed_n;
    }
    state.elastic_n = elastic_n;
  }

 private:
  void weigh(const Relaxation& relaxation, double dt_s);
};

/// A vector in the plane of the fabric.
using Vector2 = std::array<double, 2>;

/// a x + b y
inline Vector2 sum(double a, const Vector2& x, double b, const Vector2& y) {
  return {a * x[0] + b * y[0], a * x[1] + b * y[1]};
}

/// Euclidean length; not guarded against overflow, because the values of a plant are small.
inline double size(const Vector2& x) {
  return std::sqrt(x[0] * x[0] + x[1] * x[1]);
}

/// Tangential force of the fabric: bristles with the pre-sliding part of LuGre, exact for a
/// straight part of the path. Fabrics do not follow Amontons' law: F_C = mu N0 (N/N0)^n (Wilson
/// 1963; Ramkumar). Source: docs/reference/plant.md, Friction.
struct Friction {
  double coefficient = 0.2;          ///< mu at the reference load; 0: no friction
  double reference_load_n = 5;       ///< N0
  double exponent = 0.9;             ///< n, 0.7 to 1 [E]
  double bristle_length_m = 150e-6;  ///< shear of the fabric before it slides [E]

  /// Friction of full sliding under the load `normal_n`.
  [[nodiscard]] double sliding_n(double normal_n) const {
    if (normal_n <= 0) return 0;
    return coefficient * reference_load_n * std::pow(normal_n / reference_load_n, exponent);
  }
};

/// The bristle's deflection as a share of full sliding, along the motion, after `displacement_m`.
/// |share| <= 1; closed form 1 - e^{-d/l} from rest.
inline Vector2 bristle_after(const Vector2& share, const Vector2& displacement_m, double length_m) {
  const double distance = std::sqrt(displacement_m[0] * displacement_m[0] +
                                    displacement_m[1] * displacement_m[1]);  // 0 below 1e-162 m
  if (distance <= 0) return share;
  const double decay = nearby_exp(-distance / length_m), taken = (1 - decay) / distance;
  return {displacement_m[0] * taken + decay * share[0],
          displacement_m[1] * taken + decay * share[1]};
}

/// The contact at one instant, for sensors that are faster than the stages.
struct SlidingContact {
  Vector2 place_m{};         ///< of the face's centre over the fabric, fabric frame
  Vector2 friction_n{};      ///< on the fabric
  double normal_n = 0;       ///< force of the fabric on the face, >= 0
  double stiffness_n_m = 0;  ///< dF/d(indentation) of the whole face there
};

/// KES-FB3 values of one fabric, pressed from 49 Pa to 4.903 kPa (50 gf/cm2).
struct KesCompression {
  double linearity = 0;   ///< LC, in (0, 1)
  double work_j_m2 = 0;   ///< WC; 1 gf cm/cm2 = 0.980665 J/m2
  double resilience = 0;  ///< RC as a fraction, in (0, 1]
};

/// Local pressure p = p_s (e^{d/lambda} G - 1) under an indentation d; stiffness grows with load.
struct FabricLaw {
  double lambda_m = 0;     ///< indentation over which the pressure grows by e
  double pressure_pa = 0;  ///< p_s
  double hysteresis = 0;   ///< eta: unloading follows (1 - eta)/(1 + eta) of the loading curve
};

constexpr double kes_peak_pressure_pa = 4903.325;  ///< 50 gf/cm2
constexpr double kes_work_j_m2 = 0.980665;         ///< 1 gf cm/cm2

/// The law with exactly these LC, WC and RC. Errors: range, for numbers that no law of this form
/// has.
Result<FabricLaw> law_from_kes(const KesCompression& kes);

/// The sensor's cover, compliant like a fabric: local pressure p_c (e^{d/lambda_c} - 1).
struct Cover {
  double lambda_m = 0;       ///< lambda_c; 0: rigid
  double pressure_pa = 300;  ///< p_c [E]
};

/// Fabric and cover in series, as one law: their indentations add up under the same pressure. Exact
/// for pressures far above p_s and p_c. At the probe's own weight the stiffness is wrong by at most
/// 1.6 %, over the seventeen fabrics. A rigid cover gives the fabric's own law, to the bit. Source:
/// docs/reference/plant.md, Cover of the sensor.
FabricLaw compose(const FabricLaw& cloth, const Cover& cover);

/// The bare plate: stiff (5e6 N/m at 5 N under the whole face), without memory.
constexpr FabricLaw bare_plate_law() {
  return {1e-6, 1000, 0};
}

}  // namespace weft::sim
