#pragma once
// Shared code of the tests of level L2.

#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "sim/plant/dynamic/dynamic_contact.hpp"
#include "sim/plant/dynamic/lugre.hpp"
#include "sim/plant/fidelity/table.hpp"
#include "tests/unit/plant/support.hpp"

namespace weft::sim::test {

inline constexpr Integrator equal_substeps[] = {Integrator::midpoint, Integrator::tr_bdf2};
inline constexpr Integrator every[] = {Integrator::midpoint, Integrator::tr_bdf2,
                                       Integrator::adaptive};

inline std::string name_of(Integrator integrator) {
  return "L2 " + std::string(to_string(integrator));
}

inline ContactMaterial whole(const std::string& name) {
  return patch_of(library(), name, 1).material;
}

inline DynamicsParams with_step(double step_s, Integrator integrator = Integrator::midpoint) {
  DynamicsParams params;
  params.step_s = step_s;
  params.integrator = integrator;
  return params;
}

/// Hanging at rest, with the stage at `z_m`.
inline ContactState hanging(const ContactMaterial& material, double z_m, const Mount& mount = {}) {
  return ContactModel(level_plate(), mount, material).step({}, {.z_m = z_m}, 0);
}

inline DynamicsParams undamped(double step_s, Integrator integrator = Integrator::midpoint) {
  DynamicsParams params = with_step(step_s, integrator);
  params.normal_damping = params.lateral_damping = 0;
  return params;
}

/// A slow path over the fabric, into it and out again.
inline Pose down_and_up(const ContactMaterial& material, int i) {
  return {.x_m = 1e-6 * i,
          .y_m = 3e-6 * i,
          .z_m = plate_z - material.thickness_m + 2.5e-3 * std::sin(0.003 * i)};
}

inline void same_bits(const ContactState& a, const ContactState& b) {
  CHECK(a.pose == b.pose);
  CHECK(a.normal_n == b.normal_n);
  CHECK(a.extension_m == b.extension_m);
  CHECK(a.indentation_m == b.indentation_m);
  CHECK(a.velocity_mps == b.velocity_mps);
  CHECK(a.bristle == b.bristle);
  CHECK(a.friction_n == b.friction_n);
  CHECK(a.lag_m == b.lag_m);
  CHECK(a.relaxation.relaxed_n == b.relaxation.relaxed_n);
}

/// The bristles after a step of `t_s` with a slip of `v_mps`, for any friction.
inline Vector2 bristle_after_slip(const Vector2& bristle, const Vector2& v_mps, double t_s,
                                  const LuGre& lugre) {
  constexpr double inertia_n_s_m = 1e30;  // friction of some newtons is below the rounding
  const Vector2 push_n{inertia_n_s_m * v_mps[0], inertia_n_s_m * v_mps[1]};
  return solve_slip(lugre, BristleRule::exact, inertia_n_s_m, push_n, bristle, t_s, size(v_mps))
      .bristle;
}

}  // namespace weft::sim::test
