#include "sim/plant/dynamic/glide.hpp"

#include "sim/plant/dynamic/tr_bdf2.hpp"

namespace weft::sim {

namespace {

/// The slip that solves m (v - v_0)/tau = k (u_0 - tau v) - c v - F. `friction_s` is the time over
/// which the bristles move.
Slip slip(const GlideLaw& law, const LuGre& lugre, BristleRule rule, const GlideState& from,
          const Vector2& stage_mps, double tau_s, double friction_s, double guess_mps) {
  const double inertia = law.mass_kg / tau_s;
  const double a = inertia + law.damper_n_s_m + law.stiffness_n_m * tau_s;
  const Vector2 held = sum(inertia, from.room_mps, law.stiffness_n_m, from.lag_m);
  const Vector2 q = sum(1, held, a, stage_mps);
  if (!(lugre.kinetic_n > 0)) {
    const double all = a + lugre.viscous_n_s_m;
    return {{q[0] / all, q[1] / all}, {}};
  }
  return solve_slip(lugre, rule, a, q, from.bristle, friction_s, guess_mps);
}

/// An implicit Euler step of tau_s: both stages of TR-BDF2, with what came before put into `from`.
GlideState implicit_stage(const GlideLaw& law, const LuGre& lugre, const GlideState& from,
                          const Vector2& stage_mps, double tau_s, double guess_mps) {
  const Slip to = slip(law, lugre, BristleRule::implicit, from, stage_mps, tau_s, tau_s, guess_mps);
  const Vector2 room_mps = sum(1, to.w_mps, -1, stage_mps);
  return {sum(1, from.lag_m, -tau_s, room_mps), room_mps, to.bristle};
}

/// `from` moved on by tau_s with its present rates.
GlideState explicit_part(const GlideLaw& law, const LuGre& lugre, const GlideState& from,
                         const Vector2& stage_mps, double tau_s) {
  const Vector2 w = sum(1, stage_mps, 1, from.room_mps);
  Vector2 force = sum(law.stiffness_n_m, from.lag_m, -law.damper_n_s_m, from.room_mps);
  GlideState to = from;
  if (lugre.kinetic_n > 0 || lugre.viscous_n_s_m > 0) {
    force = sum(1, force, -1, lugre.force_n(from.bristle, w));
    to.bristle = sum(1, from.bristle, tau_s, lugre.bristle_rate(from.bristle, w));
  }
  to.lag_m = sum(1, from.lag_m, -tau_s, from.room_mps);
  to.room_mps = sum(1, from.room_mps, tau_s / law.mass_kg, force);
  return to;
}

}  // namespace

GlideState glide_midpoint(const GlideLaw& law, const LuGre& lugre, const GlideState& from,
                          const Vector2& stage_mps, double h_s) {
  const double guess_mps = size(sum(1, stage_mps, 1, from.room_mps));
  const Slip to = slip(law, lugre, BristleRule::exact, from, stage_mps, 0.5 * h_s, h_s, guess_mps);
  const Vector2 middle_mps = sum(1, to.w_mps, -1, stage_mps);
  return {sum(1, from.lag_m, -h_s, middle_mps), sum(2, middle_mps, -1, from.room_mps), to.bristle};
}

GlideState glide_tr_bdf2(const GlideLaw& law, const LuGre& begin, const LuGre& middle,
                         const LuGre& end, const GlideState& from, const Vector2& stage_mps,
                         double h_s) {
  const double tau_s = tr_bdf2::implicit * h_s;
  const Vector2 w = sum(1, stage_mps, 1, from.room_mps);
  const GlideState inner = implicit_stage(
      law, middle, explicit_part(law, begin, from, stage_mps, tau_s), stage_mps, tau_s, size(w));
  const auto past = [](const Vector2& at_inner, const Vector2& at_begin) {
    return sum(tr_bdf2::middle, at_inner, -tr_bdf2::begin, at_begin);
  };
  const GlideState before{past(inner.lag_m, from.lag_m), past(inner.room_mps, from.room_mps),
                          past(inner.bristle, from.bristle)};
  return implicit_stage(law, end, before, stage_mps, tau_s,
                        size(sum(1, stage_mps, 1, inner.room_mps)));
}

}  // namespace weft::sim
