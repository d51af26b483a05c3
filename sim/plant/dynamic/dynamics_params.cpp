#include "sim/plant/dynamic/dynamics_params.hpp"

#include "sim/plant/bounds.hpp"

namespace weft::sim {

namespace {

Status check_geometry(const ContactGeometry& geometry) {
  return check_bounds("geometry",
                      {{"the plate's height in m", geometry.plate_z_m, -10, 10},
                       {"half the face's width in m", geometry.face_half_width_m, 1e-5, 1},
                       {"the tilt axis in m", geometry.tilt_axis_y_m, -10, 10},
                       {"the tilt axis' depth in m", geometry.tilt_axis_depth_m, -10, 10},
                       {"the tilt along x", geometry.tilt_x, -1, 1},
                       {"the tilt along y", geometry.tilt_y, -1, 1},
                       {"the plate's tilt about x", geometry.plate_tilt_x_rad, -1, 1},
                       {"the plate's tilt about y", geometry.plate_tilt_y_rad, -1, 1},
                       {"the plate's middle in m", geometry.plate_centre_x_m, -10, 10}});
}

Status check_mount(const Mount& mount) {
  return check_bounds("mount",
                      {{"the probe's mass in kg", mount.mass_kg, 1e-6, 100},
                       {"the mount's stiffness in N/m", mount.stiffness_n_m, 1e-3, 1e10},
                       {"the slack in m", mount.slack_m, 0, 1},
                       {"the stop's stiffness in N/m", mount.stop_stiffness_n_m, 1e-3, 1e10}});
}

Status check_material(const ContactMaterial& material) {
  const Relaxation& relaxation = material.relaxation;
  const Friction& friction = material.friction;
  if (Status s = check_bounds(
          "cloth", {{"lambda in m", material.law.lambda_m, 1e-9, 1},
                    {"p_s in Pa", material.law.pressure_pa, 1e-6, 1e9},
                    {"the thickness in m", material.thickness_m, 0, 1},
                    {"the hysteresis", material.hysteresis.eta, 0, 0.999},
                    {"the hysteresis' length", material.hysteresis.length, 1e-3, 100},
                    {"the first relaxation share", relaxation.share[0], 0, 0.999},
                    {"the second relaxation share", relaxation.share[1], 0, 0.999},
                    {"the sum of the relaxation shares", relaxation.share[0] + relaxation.share[1],
                     0, 0.999},
                    {"the first relaxation time in s", relaxation.time_s[0], 1e-6, 1e9},
                    {"the second relaxation time in s", relaxation.time_s[1], 1e-6, 1e9}});
      !s)
    return s;
  return check_bounds("friction",
                      {{"the coefficient", friction.coefficient, 0, 100},
                       {"the reference load in N", friction.reference_load_n, 1e-6, 1e6},
                       {"the exponent", friction.exponent, 0, 2},
                       {"the bristles' length in m", friction.bristle_length_m, 1e-9, 1}});
}

Status check_dynamics(const DynamicsParams& params) {
  if (params.integrator > Integrator::adaptive)
    return fail({.code = Errc::range,
                 .where = "dynamics",
                 .what = "no such integrator",
                 .expected = "midpoint, tr_bdf2 or adaptive"});
  return check_bounds("dynamics",
                      {{"the step in s", params.step_s, 1e-9, 1},
                       {"the normal damping", params.normal_damping, 0, 100},
                       {"the lateral stiffness in N/m", params.lateral_stiffness_n_m, 1e-3, 1e10},
                       {"the lateral damping", params.lateral_damping, 0, 100},
                       {"the static ratio", params.static_ratio, 1, 10},
                       {"the Stribeck speed in m/s", params.stribeck_speed_mps, 1e-9, 1e3},
                       {"the speed of the friction test in m/s", params.friction_speed_mps, 0, 1e6},
                       {"the bristles' damping", params.bristle_damping, 0, 100},
                       {"the viscous friction in N s/m", params.viscous_n_s_m, 0, 1e6}});
}

}  // namespace

Status check(const ContactGeometry& geometry, const Mount& mount, const ContactMaterial& material,
             const DynamicsParams& params) {
  if (Status s = check_geometry(geometry); !s) return s;
  if (Status s = check_mount(mount); !s) return s;
  if (Status s = check_material(material); !s) return s;
  return check_dynamics(params);
}

}  // namespace weft::sim
