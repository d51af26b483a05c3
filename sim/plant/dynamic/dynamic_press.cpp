#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/plant/dynamic/motion.hpp"

namespace weft::sim {

/// Advances the memory to s = `exponent`; without contact the hysteresis starts afresh.
void DynamicContact::settle_memory(PressMemory& memory, double exponent,
                                   const RelaxationStep& relaxation) const {
  double elastic_n = 0;
  if (exponent > 0) {
    const double growth = law_.growth(memory, exponent);
    elastic_n = law_.top_n * (growth - 1);
    if (law_.hysteresis.eta > 0) {
      memory.branch = law_.branch(memory, exponent);
      elastic_n *= law_.factor(memory.branch);
    }
    memory.growth = growth;
  } else {
    memory.branch = -1;
    memory.growth = 1;
  }
  memory.exponent = exponent;
  relaxation.advance(memory.relaxation, elastic_n);
}

double DynamicContact::force_n(const PressMemory& memory) const {
  double force = memory.relaxation.elastic_n;
  for (const double relaxed : memory.relaxation.relaxed_n) force -= relaxed;
  return memory.exponent > 0 ? std::max(0.0, force) : 0;
}

DynamicContact::Pressed DynamicContact::press(const Motion& motion, const Approach& approach,
                                              double t_s, const Span& span) const {
  return params_.integrator == Integrator::tr_bdf2 ? press_tr_bdf2(motion, approach, t_s, span)
                                                   : press_midpoint(motion, approach, t_s, span);
}

/// s of a face at height `z_m`, `after_s` into a substep that began at `t_s`.
double DynamicContact::exponent_after(const Motion& motion, const Approach& approach, double t_s,
                                      double after_s, double z_m) const {
  const Vector2 lag = sum(1, motion.glide.lag_m, -after_s, motion.glide.room_mps);
  return (z_m - approach.touch_at(t_s + after_s, lag)) * law_.per_lambda;
}

PressStage DynamicContact::stage_after(const Motion& motion, const Approach& approach, double t_s,
                                       double after_s, const PressMemory& memory,
                                       const RelaxationStep& relaxation,
                                       const PressRates& rates) const {
  return {.law = law_,
          .memory = memory,
          .relaxation = relaxation,
          .z_m = motion.z_m,
          .stage_z_m = approach.stage_at(t_s + after_s),
          .stage_mps = approach.stage_z_mps,
          .exponent_at_z = exponent_after(motion, approach, t_s, after_s, motion.z_m),
          .rates = rates};
}

DynamicContact::Pressed DynamicContact::press_midpoint(const Motion& motion,
                                                       const Approach& approach, double t_s,
                                                       const Span& span) const {
  const double half_s = 0.5 * span.h_s;
  const PressRates rates{.velocity_0 = 0,
                         .velocity_d = 1 / half_s,
                         .accel_0 = -motion.v_mps / half_s,
                         .accel_d = 1 / (half_s * half_s)};
  double d_m = motion.v_mps * half_s;
  const PressStage::Value middle =
      stage_after(motion, approach, t_s, half_s, motion.memory, span.first, rates).solve(d_m);
  Pressed out{.z_m = motion.z_m + 2 * d_m,
              .v_mps = 2 * d_m / half_s - motion.v_mps,
              .memory = {middle.exponent, middle.growth, middle.branch, motion.memory.relaxation},
              .inner_normal_n = middle.force_n,
              .normal_n = 0};
  span.first.advance(out.memory.relaxation, middle.elastic_n);
  settle_memory(out.memory, exponent_after(motion, approach, t_s, span.h_s, out.z_m), span.second);
  out.normal_n = force_n(out.memory);
  return out;
}

DynamicContact::Pressed DynamicContact::press_tr_bdf2(const Motion& motion,
                                                      const Approach& approach, double t_s,
                                                      const Span& span) const {
  const double first_s = tr_bdf2::share * span.h_s, tau_s = tr_bdf2::implicit * span.h_s;
  const Mount& mount = law_.mount;
  const double accel_mps2 =
      (mount.weight_n() + mount.force_n(approach.stage_at(t_s) - motion.z_m) +
       law_.damper_n_s_m * (approach.stage_z_mps - motion.v_mps) - motion.normal_n) /
      mount.mass_kg;
  const PressRates trapezium{.velocity_0 = -motion.v_mps,
                             .velocity_d = 1 / tau_s,
                             .accel_0 = -2 * motion.v_mps / tau_s - accel_mps2,
                             .accel_d = 1 / (tau_s * tau_s)};
  double d1_m = motion.v_mps * first_s;
  const PressStage::Value middle =
      stage_after(motion, approach, t_s, first_s, motion.memory, span.first, trapezium).solve(d1_m);
  const double middle_mps = d1_m / tau_s - motion.v_mps;
  PressMemory memory{middle.exponent, middle.growth, middle.branch, motion.memory.relaxation};
  span.first.advance(memory.relaxation, middle.elastic_n);
  const double past_m = tr_bdf2::middle * d1_m;
  const double past_mps = tr_bdf2::middle * middle_mps - tr_bdf2::begin * motion.v_mps;
  const PressRates backward{.velocity_0 = -past_m / tau_s,
                            .velocity_d = 1 / tau_s,
                            .accel_0 = -(past_m / tau_s + past_mps) / tau_s,
                            .accel_d = 1 / (tau_s * tau_s)};
  double d_m = d1_m / tr_bdf2::share;
  const PressStage::Value end =
      stage_after(motion, approach, t_s, span.h_s, memory, span.second, backward).solve(d_m);
  Pressed out{.z_m = motion.z_m + d_m,
              .v_mps = (d_m - past_m) / tau_s,
              .memory = {end.exponent, end.growth, end.branch, memory.relaxation},
              .inner_normal_n = middle.force_n,
              .normal_n = end.force_n};
  if (!(end.exponent > 0)) out.memory.branch = -1;
  span.second.advance(out.memory.relaxation, end.elastic_n);
  return out;
}

// Factor by which the adaptive integrator's substeps may exceed `step_s`.
//
// Implicit midpoint rotates an oscillation of angular frequency w by (h w)^2/12 too little per
// radian. A force oscillation of amplitude a [N] has therefore an error of about a (h w)^2 before
// it decays. The oscillation follows from the motion at one instant: the imbalance of the forces,
// and the difference of the velocity from that of the contact without inertia. There is no memory,
// so a run that is divided at the stages' steps gives the same result. When `step_s` decreases, the
// substeps of oscillations decrease with it, and the error with its square (adaptive_test). Those
// of calm motion are limited to half a radian of the contact's own oscillation. They decrease once
// 16 times `step_s` is shorter than that (at 5 N 0.7 ms on denim, 0.3 ms on satin).

namespace {

/// An oscillation with this a w^2 uses substeps of step_s.
constexpr double lively_n_s2 = 1e4;
/// Upper limit of h w for any amplitude. The hysteresis of the fabric keeps a part of every
/// reversal. An unresolved oscillation would therefore shift the force in a stroke of minutes.
constexpr double longest_angle = 0.5;

/// The substep [s] for an oscillation of a mass on a spring of `k_n_m` with this imbalance;
/// `off_mps` is the velocity error.
double substep_of_swing_s(double imbalance_n, double off_mps, double k_n_m, double mass_kg,
                          double step_s) {
  const double swing_n = std::sqrt(imbalance_n * imbalance_n + k_n_m * mass_kg * off_mps * off_mps);
  const double per_k = mass_kg / k_n_m;
  return std::min(step_s * std::sqrt(lively_n_s2 * per_k / swing_n),
                  longest_angle * std::sqrt(per_k));
}

}  // namespace

/// Substep for the next `length_s` [s], from `step_s` to longest_ease times that.
double DynamicContact::substep_s(const Motion& motion, const Approach& path, double t_s,
                                 double length_s, double step_s) const {
  const double press_s = substep_of_press_s(motion, path, t_s, length_s, step_s);
  const double glide_s = substep_of_glide_s(motion, path, step_s);
  if (!(press_s > step_s && glide_s > step_s)) return step_s;  // also for NaN
  return std::min({press_s, glide_s, longest_ease * step_s});
}

/// `step_s` if the face is about to touch or leave the fabric, or the probe a stop of its mount.
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
  if (!(k_n_m > 0)) return step_s;  // in free flight
  const double imbalance_n = mount.weight_n() + mount.force_n(extension_m) +
                             law_.damper_n_s_m * stretches_mps - motion.normal_n;
  const double follows_mps = (mount_n_m * path.stage_z_mps + cloth_n_m * path.touch_mps) / k_n_m;
  return substep_of_swing_s(imbalance_n, motion.v_mps - follows_mps, k_n_m, mount.mass_kg, step_s);
}

/// The bristles are a second spring beside the guide's.
double DynamicContact::substep_of_glide_s(const Motion& motion, const Approach& path,
                                          double step_s) const {
  const GlideState& glide = motion.glide;
  NearPower power = motion.power;  // a copy: the motion must not change
  const LuGre lugre = friction(motion.normal_n, power);
  const Vector2 slip_mps = sum(1, path.stage_mps, 1, glide.room_mps);
  const Vector2 guide_n =
      sum(glide_law_.stiffness_n_m, glide.lag_m, -glide_law_.damper_n_s_m, glide.room_mps);
  const Vector2 imbalance_n = sum(1, guide_n, -1, lugre.force_n(glide.bristle, slip_mps));
  return substep_of_swing_s(size(imbalance_n), size(glide.room_mps),
                            glide_law_.stiffness_n_m + lugre.kinetic_n / lugre.length_m,
                            glide_law_.mass_kg, step_s);
}

namespace {

constexpr double settled = 1e-13;     // of the forces; such a guess needs no step
constexpr double deep_exponent = 40;  // no bench presses so far (0.1 GPa on the softest fabric)
constexpr int newton_limit = 100;     // 2 or 3 in use
constexpr double tolerance = 1e-5;    // in s; the method is quadratic: its square remains

}  // namespace

double PressLaw::growth(const PressMemory& memory, double s) const {
  const double held = std::min(s, largest_exponent);
  if (!(memory.exponent >= 0 && memory.exponent < largest_exponent)) return std::exp(held);
  return memory.growth * near_exp(held - memory.exponent);
}

double PressLaw::branch(const PressMemory& memory, double s) const {
  const double moved = s - std::max(memory.exponent, 0.0);  // constant without contact
  return branch_after(memory.branch, moved, near_exp(-std::abs(moved) * per_length));
}

PressStage::Value PressStage::at(double d_m, double offset_n) const {
  const double s = exponent_at_z + d_m * law.per_lambda;
  const double extension = stage_z_m - z_m - d_m;
  Value value{0, 0, s, 1, 0, 0, memory.branch};
  const double inertia_n = law.mount.mass_kg * (rates.accel_0 + rates.accel_d * d_m);
  const double damper_n =
      law.damper_n_s_m * (stage_mps - rates.velocity_0 - rates.velocity_d * d_m);
  value.residual_n = law.mount.weight_n() + law.mount.force_n(extension) + damper_n - inertia_n;
  value.slope_n_m = -law.mount.slope_n_m(extension) - law.damper_n_s_m * rates.velocity_d -
                    law.mount.mass_kg * rates.accel_d;
  if (!(s > 0)) return value;
  value.growth = law.growth(memory, s);
  value.elastic_n = law.top_n * (value.growth - 1);
  double slope = law.top_n * value.growth;
  if (const Hysteresis& h = law.hysteresis; h.eta > 0) {
    const double from = std::max(memory.exponent, 0.0);
    value.branch = law.branch(memory, s);
    const double factor = law.factor(value.branch);
    const double turning = (s > from ? 1 - value.branch : 1 + value.branch) * law.per_length;
    slope = slope * factor + value.elastic_n * law.turn * turning;
    value.elastic_n *= factor;
  }
  value.force_n = relaxation.gain * value.elastic_n - offset_n;
  if (value.force_n > 0) {
    value.residual_n -= value.force_n;
    value.slope_n_m -= relaxation.gain * slope * law.per_lambda;
  } else {
    value.force_n = 0;
  }
  return value;
}

/// The value after a last short step, with the accuracy of Newton's method. If that step crosses a
/// corner of the curve the value is computed in full.
PressStage::Value PressStage::follow(const Value& from, double d_m, double ds,
                                     double offset_n) const {
  Value value = from;
  value.exponent += ds;
  const double turn_at = std::max(memory.exponent, 0.0);
  if (!(from.exponent > 0) || !(value.exponent > 0) ||
      (from.exponent > turn_at) != (value.exponent > turn_at))
    return at(d_m, offset_n);
  value.growth *= 1 + ds * (1 + 0.5 * ds);
  value.elastic_n = law.top_n * (value.growth - 1);
  if (law.hysteresis.eta > 0) {
    const double turning = value.exponent > turn_at ? 1 - value.branch : 1 + value.branch;
    value.branch += ds * turning * law.per_length;
    value.elastic_n *= law.factor(value.branch);
  }
  value.force_n = std::max(0.0, relaxation.gain * value.elastic_n - offset_n);
  return value;
}

/// Upper limit of the depth for any load: at the root the fabric carries at most the load at s = 0.
double PressStage::highest_m(double offset_n) const {
  const double at_touch_m = -exponent_at_z * law.lambda_m;
  const double load_n = at(at_touch_m, offset_n).residual_n;
  if (!(load_n > 0)) return at_touch_m;
  const double weakest = relaxation.gain * branch_factor(-1, law.hysteresis.eta) * law.top_n;
  return at_touch_m + law.lambda_m * std::log1p((load_n + offset_n) / weakest);
}

PressStage::Value PressStage::solve(double& d_m) const {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const double offset_n = relaxation.offset_n(memory.relaxation);
  double low = -infinity, high = infinity;
  double d = d_m;
  // A guess or a Newton step far up the exponential is limited by the top of the bracket.
  const double guess = exponent_at_z + d * law.per_lambda;
  if (guess > std::min(std::max(memory.exponent, 0.0) + 1, deep_exponent))
    d = std::min(d, high = highest_m(offset_n));
  Value value{};
  for (int i = 0; i < newton_limit; ++i) {
    value = at(d, offset_n);
    if (std::abs(value.residual_n) <= settled * (law.mount.weight_n() + value.force_n)) break;
    (value.residual_n > 0 ? low : high) = d;
    double next = d - value.residual_n / value.slope_n_m;
    if (high == infinity &&
        exponent_at_z + next * law.per_lambda > std::max(value.exponent, 0.0) + 1)
      high = std::max(d, highest_m(offset_n));
    if (!(next >= low && next <= high))
      next = std::isfinite(low) && std::isfinite(high) ? 0.5 * (low + high)
                                                       : std::clamp(next, low, high);
    const double step_m = next - d;
    if (!(std::abs(step_m) > 0)) break;
    d = next;
    if (std::abs(step_m) < tolerance * law.lambda_m) {
      value = follow(value, d, step_m * law.per_lambda, offset_n);
      break;
    }
  }
  d_m = d;
  return value;
}

}  // namespace weft::sim
