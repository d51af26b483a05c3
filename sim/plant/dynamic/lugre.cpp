#include "sim/plant/dynamic/lugre.hpp"

#include <algorithm>

namespace weft::sim {

namespace {

constexpr int newton_limit = 80;              // 2 or 3 in use
constexpr double relative_tolerance = 1e-10;  // of a quadratic method: what is left is its square
constexpr double absolute_tolerance_mps = 1e-16;
constexpr double series_below = 2e-3;  // x^5/720 is below the rounding there

/// What a step takes off the old bristles: at its end and in its force, with both derivatives.
struct Shares {
  double end, force, end_slope, force_slope;
};

Shares shares_taken(BristleRule rule, double x) {
  if (rule == BristleRule::implicit) {
    const double kept = 1 / (1 + x);
    return {x * kept, x * kept, kept * kept, kept * kept};
  }
  if (x < series_below) {
    const double end = x * (1 - x / 2 * (1 - x / 3 * (1 - x / 4 * (1 - x / 5))));
    const double force = x / 2 * (1 - x / 3 * (1 - x / 4 * (1 - x / 5)));
    const double slope = 0.5 - x / 3 * (1 - 3 * x / 8 * (1 - 4 * x / 15));
    return {end, force, 1 - end, slope};
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

  struct Value {
    double residual, slope;
    Vector2 rest;  // q - Q b: its direction is the slip's
    double rest_size;
  };

  [[nodiscard]] Value at(double u) const {
    const double over = u / lugre.stribeck_mps;
    const double excess = (lugre.static_ratio - 1) * std::exp(-over * over);
    const double r = 1 + excess, r_slope = -2 * over / lugre.stribeck_mps * excess;
    const double rate = t_s / (lugre.length_m * r);
    const double x = u * rate, x_slope = rate * (1 - u * r_slope / r);
    const Shares s = shares_taken(rule, x);
    const double f = lugre.kinetic_n, d = lugre.damping_n_s_m * lugre.length_m / t_s;
    const double taken = f * s.force + d * s.end;  // P = r taken, Q = F_C - taken
    const double taken_slope = x_slope * (f * s.force_slope + d * s.end_slope);
    const double left = f - taken;
    const Vector2 rest{q[0] - left * b[0], q[1] - left * b[1]};
    const double size = std::sqrt(rest[0] * rest[0] + rest[1] * rest[1]);
    const double along = size > 0 ? (rest[0] * b[0] + rest[1] * b[1]) / size : 0;
    return {a * u + r * taken - size, a + r_slope * taken + (r - along) * taken_slope, rest, size};
  }

  /// No slip is faster: P cannot be negative and |Q| is bounded.
  [[nodiscard]] double fastest() const {
    const double most = lugre.kinetic_n + lugre.damping_n_s_m * lugre.length_m / t_s;
    return (std::hypot(q[0], q[1]) + most * std::hypot(b[0], b[1])) / a;
  }
};

}  // namespace

Vector2 LuGre::bristle_rate(const Vector2& bristle, const Vector2& v_mps) const {
  const double speed = std::hypot(v_mps[0], v_mps[1]), pull = speed / limit_ratio(speed);
  return {(v_mps[0] - pull * bristle[0]) / length_m, (v_mps[1] - pull * bristle[1]) / length_m};
}

Vector2 LuGre::force_n(const Vector2& bristle, const Vector2& v_mps) const {
  const Vector2 rate = bristle_rate(bristle, v_mps);
  const double sigma1_l = damping_n_s_m * length_m;
  return {kinetic_n * bristle[0] + sigma1_l * rate[0] + viscous_n_s_m * v_mps[0],
          kinetic_n * bristle[1] + sigma1_l * rate[1] + viscous_n_s_m * v_mps[1]};
}

Vector2 bristle_after(const Vector2& bristle, const Vector2& v_mps, double t_s, const LuGre& lugre,
                      BristleRule rule) {
  const double speed = std::sqrt(v_mps[0] * v_mps[0] + v_mps[1] * v_mps[1]);
  if (!(speed > 0)) return bristle;
  const double r = lugre.limit_ratio(speed);
  const double end = shares_taken(rule, speed * t_s / (lugre.length_m * r)).end;
  const double full = r / speed;
  return {bristle[0] + end * (full * v_mps[0] - bristle[0]),
          bristle[1] + end * (full * v_mps[1] - bristle[1])};
}

Vector2 solve_slip(const LuGre& lugre, BristleRule rule, double a_n_s_m, const Vector2& q_n,
                   const Vector2& bristle, double t_s, double guess_mps) {
  const SlipEquation equation{lugre, rule, a_n_s_m + lugre.viscous_n_s_m, t_s, q_n, bristle};
  double low = 0, high = equation.fastest();
  double u = std::clamp(guess_mps, low, high);
  SlipEquation::Value value = equation.at(u);
  for (int i = 0; i < newton_limit; ++i) {
    (value.residual > 0 ? high : low) = u;
    double next = u - value.residual / value.slope;
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    const double moved = std::abs(next - u);
    u = next;
    value = equation.at(u);
    if (moved <= relative_tolerance * u + absolute_tolerance_mps) break;
  }
  if (!(value.rest_size > 0)) return {};
  return {u * value.rest[0] / value.rest_size, u * value.rest[1] / value.rest_size};
}

}  // namespace weft::sim
