#pragma once
// What level L2 knows beyond L1: the probe's inertia, its guide, and friction that falls with
// speed. Source: docs/reference/plant.md, Contact law, Friction, Integrators.

#include <cstdint>

#include "sim/plant/contact.hpp"

namespace weft::sim {

enum class Integrator : std::uint8_t {
  midpoint,  ///< implicit midpoint with exact memory: keeps undamped motion; for steps that resolve
  tr_bdf2,   ///< L-stable: damps what the step does not resolve; for coarse steps
  adaptive   ///< implicit midpoint whose substeps are longer where the contact is calm
};

struct DynamicsParams {
  /// Substeps are equal and at most this long; nothing else depends on it. Of the adaptive
  /// integrator: their length while the probe swings. A sixteenth of a pad's conversion
  /// (tests/bench/plant_levels.cc has its error and its price).
  double step_s = 192e-6;
  Integrator integrator = Integrator::adaptive;
  double normal_damping = 0.05;        ///< ratio of the mount's spring with the probe's mass [E]
  double lateral_stiffness_n_m = 1e5;  ///< k_l of guide and mount along x and y [E]
  double lateral_damping = 0.05;       ///< ratio, as above [E]
  double static_ratio = 1.2;           ///< F_S/F_C, 1.1 to 1.3 [E]
  double stribeck_speed_mps = 5e-3;    ///< v_s, 1 to 10 mm/s [E]
  /// Speed at which the cloth's friction was measured: there Friction::sliding_n holds (KES-FB4
  /// moves at 1 mm/s [E]).
  double friction_speed_mps = 1e-3;
  double bristle_damping = 0.3;  ///< ratio of the bristles with the probe's mass (sigma_1) [E]
  double viscous_n_s_m = 0;      ///< sigma_2 [E]
};

/// Refuses what the equations have no solution for or doubles no room: NaN, infinities, negative
/// stiffness, steps outside 1 ns to 1 s, and so on. Errors: range, naming the field.
Status check(const ContactGeometry& geometry, const Mount& mount, const ContactMaterial& material,
             const DynamicsParams& params);

}  // namespace weft::sim
