#include "sim/plant/dynamic/press_stage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/plant/near.hpp"

namespace weft::sim {

namespace {

constexpr double settled = 1e-13;     // of the forces: such a guess needs no step
constexpr double deep_exponent = 40;  // no bench presses so far (0.1 GPa on the softest cloth)
constexpr int newton_limit = 100;     // 2 or 3 in use
constexpr double tolerance = 1e-5;    // in s, of a quadratic method: what is left is its square

}  // namespace

double PressLaw::growth(const PressMemory& memory, double s) const {
  const double held = std::min(s, largest_exponent);
  if (!(memory.exponent >= 0 && memory.exponent < largest_exponent)) return std::exp(held);
  return memory.growth * near_exp(held - memory.exponent);
}

double PressLaw::branch(const PressMemory& memory, double s) const {
  const double moved = s - std::max(memory.exponent, 0.0);  // in the air nothing turns
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

/// The value a last short step further, as exactly as Newton has found it; in full where that step
/// crosses a corner of the curve.
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

/// No load leads deeper than this: at the root the cloth carries no more than what acts at s = 0.
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
  // A guess or a Newton step that goes far up the exponential is held below the bracket's top.
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
