#include "sim/plant/dynamic/lugre.hpp"

#include <algorithm>
#include <limits>

#include "sim/plant/near.hpp"

namespace weft::sim {
namespace {

constexpr int newton_limit = 80;             // 2 or 3 in use
constexpr double relative_tolerance = 1e-5;  // the method is quadratic: its square remains
constexpr double absolute_tolerance_mps = 1e-16;
constexpr double series_below = 0.02;

/// Reduction of the old bristles by a step, at its end and in its force, with both derivatives.
struct Shares {
  double end, force, end_slope, force_slope;
};

inline Shares shares_taken(BristleRule rule, double x) {
  if (rule == BristleRule::implicit) {
    const double retained = 1 / (1 + x);
    return {x * retained, x * retained, retained * retained, retained * retained};
  }
  if (x < series_below) {
    // t = 2 (e^-x - 1 + x)/x^2, the sum of 2 (-x)^k/(k + 2)!; the truncation error is below 1e-18.
    constexpr std::array<double, 8> series{1,         -1.0 / 3,    1.0 / 12,    -1.0 / 60,
                                           1.0 / 360, -1.0 / 2520, 1.0 / 20160, -1.0 / 181440};
    const double t = polynomial_7(series, x);
    const double force = 0.5 * x * t, end = x * (1 - force);
    return {end, force, 1 - end, 1 - 0.5 * t - 0.5 * x * t};
  }
  const double end = -std::expm1(-x);
  const double mean = end / x;
  return {end, 1 - mean, 1 - end, (mean - (1 - end)) / x};
}

/// The scalar equation for the slip speed u and its derivative.
struct SlipEquation {
  const LuGre& lugre;
  BristleRule rule;
  double a, t_s;
  Vector2 q, b;
  double sigma1_l = lugre.damping_n_s_m * lugre.length_m / t_s;
  double per_stribeck = 1 / lugre.stribeck_mps, per_length = t_s / lugre.length_m;

  struct Value {
    double residual, slope;
    double end, end_slope;  // reduction of the bristles at the end of the step
    Vector2 rest;           // q - Q b: its direction is that of the slip
    double rest_slope;      // its change with u, along b
    double per_size;        // 1/|rest|, 0 if rest is 0
    double along;           // part of b in the direction of rest
  };

  [[nodiscard]] Value at(double u, double excess) const {
    const double r = 1 + excess, per_r = 1 / r;
    const double r_slope = -2 * u * per_stribeck * per_stribeck * excess;
    const double rate = per_length * per_r;
    const double x = u * rate, x_slope = rate * (1 - u * r_slope * per_r);
    const Shares s = shares_taken(rule, x);
    const double f = lugre.kinetic_n;
    const double taken = f * s.force + sigma1_l * s.end;  // P = r taken, Q = F_C - taken
    const double taken_slope = x_slope * (f * s.force_slope + sigma1_l * s.end_slope);
    const double left = f - taken;
    const Vector2 rest{q[0] - left * b[0], q[1] - left * b[1]};
    const double rest_size = size(rest);
    const double per_size = rest_size > 0 ? 1 / rest_size : 0;
    const double along = (rest[0] * b[0] + rest[1] * b[1]) * per_size;
    return {a * u + r * taken - rest_size,
            a + r_slope * taken + (r - along) * taken_slope,
            s.end,
            x_slope * s.end_slope,
            rest,
            taken_slope,
            per_size,
            along};
  }

  /// Upper limit of the slip: P cannot be negative and |Q| is bounded.
  [[nodiscard]] double fastest() const {
    return (size(q) + (lugre.kinetic_n + sigma1_l) * size(b)) / a;
  }
};

/// The slip that solves m (v - v_0)/tau = k (u_0 - tau v) - c v - F. `friction_s` is the duration
/// of the motion of the bristles.
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

/// An implicit Euler step of tau_s: both stages of TR-BDF2, with the earlier parts included in
/// `from`.
GlideState implicit_stage(const GlideLaw& law, const LuGre& lugre, const GlideState& from,
                          const Vector2& stage_mps, double tau_s, double guess_mps) {
  const Slip to = slip(law, lugre, BristleRule::implicit, from, stage_mps, tau_s, tau_s, guess_mps);
  const Vector2 room_mps = sum(1, to.w_mps, -1, stage_mps);
  return {sum(1, from.lag_m, -tau_s, room_mps), room_mps, to.bristle};
}

/// `from` advanced by tau_s with its present rates.
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

Vector2 LuGre::bristle_rate(const Vector2& bristle, const Vector2& v_mps) const {
  const double speed = size(v_mps), pull = speed / limit_ratio(speed);
  return {(v_mps[0] - pull * bristle[0]) / length_m, (v_mps[1] - pull * bristle[1]) / length_m};
}

Vector2 LuGre::force_n(const Vector2& bristle, const Vector2& v_mps) const {
  const Vector2 rate = bristle_rate(bristle, v_mps);
  const double sigma1_l = damping_n_s_m * length_m;
  return {kinetic_n * bristle[0] + sigma1_l * rate[0] + viscous_n_s_m * v_mps[0],
          kinetic_n * bristle[1] + sigma1_l * rate[1] + viscous_n_s_m * v_mps[1]};
}

Slip solve_slip(const LuGre& lugre, BristleRule rule, double a_n_s_m, const Vector2& q_n,
                const Vector2& bristle, double t_s, double guess_mps) {
  const SlipEquation equation{lugre, rule, a_n_s_m + lugre.viscous_n_s_m, t_s, q_n, bristle};
  double low = 0, high = std::numeric_limits<double>::infinity(), u = guess_mps;
  SlipEquation::Value value{};
  double squared = u * equation.per_stribeck * u * equation.per_stribeck;
  double excess = (lugre.static_ratio - 1) * std::exp(-squared);
  for (int i = 0; i < newton_limit; ++i) {
    value = equation.at(u, excess);
    (value.residual > 0 ? high : low) = u;
    double next = u - value.residual / value.slope;
    if (!(value.slope > 0 && next >= low && next <= high)) {
      high = std::min(high, equation.fastest());
      next = 0.5 * (low + high);
    }
    const double step = next - u;
    if (std::abs(step) <= relative_tolerance * u + absolute_tolerance_mps) {
      // Within Newton's own error, the quantities that depend on u change linearly.
      value.end += step * value.end_slope;
      value.rest = {value.rest[0] + step * value.rest_slope * bristle[0],
                    value.rest[1] + step * value.rest_slope * bristle[1]};
      value.per_size *= 1 - step * value.rest_slope * value.along * value.per_size;
      excess -= 2 * u * step * equation.per_stribeck * equation.per_stribeck * excess;
      u = next;
      break;
    }
    u = next;
    const double now = u * equation.per_stribeck * u * equation.per_stribeck;
    // An underflowed value stays zero in a product, so it is computed in full.
    excess = squared < 600 ? excess * near_exp(squared - now)
                           : (lugre.static_ratio - 1) * std::exp(-now);
    squared = now;
  }
  if (!(value.per_size > 0)) return {{}, bristle};
  const Vector2 along{value.rest[0] * value.per_size, value.rest[1] * value.per_size};
  const double full = 1 + excess;
  return {{u * along[0], u * along[1]},
          {bristle[0] + value.end * (full * along[0] - bristle[0]),
           bristle[1] + value.end * (full * along[1] - bristle[1])}};
}

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
