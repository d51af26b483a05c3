#include "recipes/control/force_loop.hpp"

#include <algorithm>
#include <cmath>

namespace weft::recipes {
namespace {

/// A move shorter than this many quanta measures rounding rather than stiffness.
constexpr double move_quanta = 5;
/// A slower move measures the relaxation of the fabric, not its stiffness [s].
constexpr double move_max_s = 0.2;
/// Weight of the past after each measured move.
constexpr double forgetting = 0.7;
/// The initial stiffness has the weight of one move of this many quanta.
constexpr double prior_quanta = 20;
/// Share of the stage's deceleration that braking before the set point relies on.
constexpr double braking_share = 0.5;
/// The stage can reach a position to half a quantum either way.
constexpr double dead_quanta = 0.5;

bool usable(const ForceLoopInput& input) {
  return std::isfinite(input.setpoint_n) && std::isfinite(input.force_n) &&
         std::isfinite(input.z_m) && std::isfinite(input.dt_s) && input.dt_s > 0;
}

void set_anchor(ForceLoopState& state, const ForceLoopInput& input) {
  state.anchor_force_n = input.force_n;
  state.anchor_z_m = input.z_m;
  state.anchor_age_s = 0;
}

void prime(const ForceLoopConfig& config, ForceLoopState& state, const ForceLoopInput& input) {
  const double reach = prior_quanta * config.position_quantum_m;
  state.primed = true;
  state.slope_zz_m2 = reach * reach;
  state.slope_zf_nm = config.stiffness_initial_npm * reach * reach;
  set_anchor(state, input);
}

void learn(const ForceLoopConfig& config, ForceLoopState& state, const ForceLoopInput& input) {
  state.anchor_age_s += input.dt_s;
  const double dz = input.z_m - state.anchor_z_m;
  if (std::abs(dz) < move_quanta * config.position_quantum_m) {
    if (state.anchor_age_s > move_max_s) set_anchor(state, input);
    return;
  }
  if (state.anchor_age_s <= move_max_s) {
    state.slope_zz_m2 = forgetting * state.slope_zz_m2 + dz * dz;
    state.slope_zf_nm =
        forgetting * state.slope_zf_nm + dz * (input.force_n - state.anchor_force_n);
  }
  set_anchor(state, input);
}

double stiffness(const ForceLoopConfig& config, const ForceLoopState& state, double force_n) {
  const double softest = std::max(config.stiffness_min_npm, std::min(force_n / config.lambda_max_m,
                                                                     config.stiffness_initial_npm));
  const double slope = state.slope_zf_nm / state.slope_zz_m2;
  return std::min(std::max(slope, softest), config.stiffness_max_npm);
}

/// Reduces the magnitude of `error` by `dead`: continuous, so that the edge does not chatter.
double outside_dead_band(double error, double dead) {
  return std::copysign(std::max(0.0, std::abs(error) - dead), error);
}

/// Fastest speed from which a stage that receives the stop late still stops within `way_m`: v
/// latency + v^2 / (2 a) = way.
double braking_speed(const ForceLoopConfig& config, double way_m) {
  const double a = braking_share * config.max_acceleration_mps2;
  const double lost = a * config.latency_s;
  return std::sqrt(lost * lost + 2 * a * way_m) - lost;
}

/// Uses the force hold if it can. The integral here and the drift there both follow the relaxation
/// of the fabric, so each starts from the other's value.
std::optional<double> hold(const ForceLoopConfig& config, ForceLoopState& state,
                           const ForceLoopInput& input) {
  const double per_s = config.loop_gain / config.cycle_s;
  const bool held = state.hold.active;
  if (!held) state.hold.drift_nps = -per_s * state.integral_n;
  const auto mps = hold_force(config.hold, state.hold,
                              {input.setpoint_n, input.force_n, input.fresh, input.z_m, input.dt_s,
                               state.stiffness_npm, config.position_quantum_m});
  if (held && !mps) state.integral_n = -state.hold.drift_nps / per_s;
  return mps;
}

}  // namespace

ForceCommand step(const ForceLoopConfig& config, ForceLoopState& state,
                  const ForceLoopInput& input) {
  if (!usable(input)) return {};
  if (!state.primed) prime(config, state, input);
  if (input.learn_stiffness) learn(config, state, input);
  state.stiffness_npm = stiffness(config, state, input.force_n);

  const double gain_per_s = config.loop_gain / std::max(config.cycle_s, input.dt_s);
  if (const auto held_mps = hold(config, state, input))
    return {std::clamp(*held_mps, -config.max_speed_mps, config.max_speed_mps)};
  const double error_n =
      outside_dead_band(input.setpoint_n - input.force_n,
                        dead_quanta * config.position_quantum_m * state.stiffness_npm);
  const double mps_per_n = gain_per_s / state.stiffness_npm;
  const double braking_mps = braking_speed(config, std::abs(error_n) / state.stiffness_npm);
  const double proportional_mps = std::clamp(mps_per_n * error_n, -braking_mps, braking_mps);
  const double integral_n = state.integral_n + error_n * input.dt_s / config.integral_time_s;
  const double wanted_mps = proportional_mps + mps_per_n * integral_n;
  const double given_mps = std::clamp(wanted_mps, -config.max_speed_mps, config.max_speed_mps);
  // Anti-windup: no integration while a limit determines the speed instead of the error.
  if (given_mps == wanted_mps && std::abs(mps_per_n * error_n) <= braking_mps)
    state.integral_n = integral_n;
  return {given_mps};
}

bool SettleDetector::step(double error_n, double dt_s) {
  const bool inside = std::abs(error_n) <= band_n;
  inside_s = inside ? inside_s + dt_s : 0;
  return inside && inside_s >= dwell_s;
}

}  // namespace weft::recipes
