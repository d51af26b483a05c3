// How much longer than `step_s` the adaptive integrator's substeps may be.
//
// Implicit midpoint turns a swing of the angular frequency w by (h w)^2/12 too little per radian,
// so that a force that swings by a [N] is wrong by about a (h w)^2 before it has died away. What
// the swing is follows from the motion at one instant: the forces' imbalance and how far the
// velocity is from the one that the contact would follow without inertia. Nothing is remembered, so
// that a run that is split at the stages' steps does the same. As `step_s` falls, the substeps of
// swings fall with it, and the error with its square (adaptive_test). Those of the calm follow once
// 16 of it are shorter than half a radian of the contact's own swing (at 5 N 0.7 ms on denim,
// 0.3 ms on satin).

#include <algorithm>
#include <cmath>

#include "sim/plant/dynamic/motion.hpp"

namespace weft::sim {

namespace {

/// A swing whose a w^2 is this takes substeps of step_s.
constexpr double lively_n_s2 = 1e4;
/// Of h w, however small the swing: the cloth's hysteresis keeps something of every reversal, so
/// that a swing that is not resolved shifts the force in a slide of minutes.
constexpr double longest_angle = 0.5;

/// The substep [s] for a swing of a mass on a spring of `k_n_m` with this imbalance, off its path
/// by `off_mps`.
double substep_of_swing_s(double imbalance_n, double off_mps, double k_n_m, double mass_kg,
                          double step_s) {
  const double swing_n = std::sqrt(imbalance_n * imbalance_n + k_n_m * mass_kg * off_mps * off_mps);
  const double per_k = mass_kg / k_n_m;
  return std::min(step_s * std::sqrt(lively_n_s2 * per_k / swing_n),
                  longest_angle * std::sqrt(per_k));
}

}  // namespace

/// Over the next `length_s` [s], from `step_s` to longest_ease times that.
double DynamicContact::substep_s(const Motion& motion, const Approach& path, double t_s,
                                 double length_s, double step_s) const {
  const double press_s = substep_of_press_s(motion, path, t_s, length_s, step_s);
  const double glide_s = substep_of_glide_s(motion, path, step_s);
  if (!(press_s > step_s && glide_s > step_s)) return step_s;  // also where one is not a number
  return std::min({press_s, glide_s, longest_ease * step_s});
}

/// `step_s` where the face is about to touch or leave the cloth, or the probe a stop of its mount.
double DynamicContact::substep_of_press_s(const Motion& motion, const Approach& path, double t_s,
                                          double length_s, double step_s) const {
  const Mount& mount = law_.mount;
  const double depth_m = motion.z_m - path.touch_at(t_s, motion.glide.lag_m);
  const double sinks_mps = motion.v_mps - path.touch_mps;
  if ((depth_m > 0) != (depth_m + sinks_mps * length_s > 0)) return step_s;
  const double extension_m = path.stage_at(t_s) - motion.z_m;
  const double stretches_mps = path.stage_z_mps - motion.v_mps;
  const double mount_n_m = mount.slope_n_m(extension_m);
  if (mount_n_m != mount.slope_n_m(extension_m + stretches_mps * length_s)) return step_s;
  const double cloth_n_m = depth_m > 0 ? stiffness_n_m(motion.normal_n) : 0;
  const double k_n_m = mount_n_m + cloth_n_m;
  if (!(k_n_m > 0)) return step_s;  // it flies
  const double imbalance_n = mount.weight_n() + mount.force_n(extension_m) +
                             law_.damper_n_s_m * stretches_mps - motion.normal_n;
  const double follows_mps = (mount_n_m * path.stage_z_mps + cloth_n_m * path.touch_mps) / k_n_m;
  return substep_of_swing_s(imbalance_n, motion.v_mps - follows_mps, k_n_m, mount.mass_kg, step_s);
}

/// The bristles are a second spring beside the guide's.
double DynamicContact::substep_of_glide_s(const Motion& motion, const Approach& path,
                                          double step_s) const {
  const GlideState& glide = motion.glide;
  NearPower power = motion.power;  // a look leaves no trace in the motion
  const LuGre lugre = friction(motion.normal_n, power);
  const Vector2 slip_mps = sum(1, path.stage_mps, 1, glide.room_mps);
  const Vector2 guide_n =
      sum(glide_law_.stiffness_n_m, glide.lag_m, -glide_law_.damper_n_s_m, glide.room_mps);
  const Vector2 imbalance_n = sum(1, guide_n, -1, lugre.force_n(glide.bristle, slip_mps));
  return substep_of_swing_s(size(imbalance_n), size(glide.room_mps),
                            glide_law_.stiffness_n_m + lugre.kinetic_n / lugre.length_m,
                            glide_law_.mass_kg, step_s);
}

}  // namespace weft::sim
