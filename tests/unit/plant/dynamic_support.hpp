#pragma once
// What the tests of level L2 share.

#include <string>

#include "sim/plant/dynamic/dynamic_contact.hpp"
#include "tests/unit/plant/support.hpp"

namespace weft::sim::test {

inline constexpr Integrator both[] = {Integrator::midpoint, Integrator::tr_bdf2};

inline ContactMaterial whole(const std::string& name) {
  return patch_of(library(), name, 1).material;
}

inline DynamicsParams with_step(double step_s, Integrator integrator = Integrator::midpoint) {
  DynamicsParams params;
  params.step_s = step_s;
  params.integrator = integrator;
  return params;
}

/// Hanging at rest, the stage at `z_m`.
inline ContactState hanging(const ContactMaterial& material, double z_m, const Mount& mount = {}) {
  return ContactModel(level_plate(), mount, material).step({}, {.z_m = z_m}, 0);
}

inline DynamicsParams undamped(double step_s, Integrator integrator = Integrator::midpoint) {
  DynamicsParams params = with_step(step_s, integrator);
  params.normal_damping = params.lateral_damping = 0;
  return params;
}

}  // namespace weft::sim::test
