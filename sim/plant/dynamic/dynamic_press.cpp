#include <algorithm>

#include "sim/plant/dynamic/motion.hpp"

namespace weft::sim {

/// The memory moves on to s = `exponent`; off the cloth its hysteresis starts afresh.
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

/// s of a face at the height `z_m`, `after_s` into a substep that began at `t_s`.
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

}  // namespace weft::sim
