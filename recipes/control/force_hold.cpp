#include "recipes/control/force_hold.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace weft::recipes {
namespace {

/// A stage within this share of a quantum from the middle of its target is not moved.
constexpr double middle_share = 0.25;

void begin(ForceHoldState& state, const ForceHoldInput& input, double z_m) {
  state.active = true;
  state.force_n = input.force_n;
  state.age_s = state.uncorrected_s = state.still_s = 0;
  state.z_m = state.target_m = z_m;
}

/// Estimates the force now from the drift and the motion of the stage.
void predict(ForceHoldState& state, const ForceHoldInput& input, double z_m) {
  state.force_n += state.drift_nps * input.dt_s + input.stiffness_npm * (z_m - state.z_m);
  state.age_s += input.dt_s;
  state.uncorrected_s += input.dt_s;
  state.z_m = z_m;
}

/// Corrects the estimate by one reading for the time since the last one. That time may be long, but
/// it is one correction.
void correct(const ForceHoldConfig& config, ForceHoldState& state, const ForceHoldInput& input) {
  const double off_n = input.force_n - state.force_n;
  const double dt_s = std::exchange(state.uncorrected_s, 0);
  if (dt_s == 0) return;
  const double steady =
      config.pole_radps * std::sqrt(input.stiffness_npm / config.pole_stiffness_npm);
  const double w = std::min(std::clamp(std::max(steady, config.learning / state.age_s),
                                       config.slowest_radps, config.fastest_radps),
                            1 / dt_s);
  state.force_n += off_n * -std::expm1(-std::numbers::sqrt2 * w * dt_s);
  state.drift_nps += off_n * w * w * dt_s;
}

/// Whether one more quantum could reduce the error. It cannot if the last move came from the other
/// side.
bool is_worth_trying(const ForceHoldConfig& config, const ForceHoldState& state, double off_n) {
  return state.still_s >= config.patience_s && std::abs(off_n) > config.offset_n &&
         state.moved * off_n >= 0;
}

/// Chooses the stage position. `off_n`: the expected force is this far below the set point.
void choose_target(const ForceHoldConfig& config, ForceHoldState& state,
                   const ForceHoldInput& input, double off_n) {
  const double way_m = off_n / input.stiffness_npm;
  state.still_s += input.dt_s;
  double quanta = 0;
  if (std::abs(way_m) > input.quantum_m / 2)
    quanta = std::round(way_m / input.quantum_m);
  else if (is_worth_trying(config, state, off_n))
    quanta = std::copysign(1, off_n);
  if (quanta == 0) return;
  state.target_m = state.z_m + input.quantum_m * quanta;
  state.moved = std::copysign(1, off_n);
  state.still_s = 0;
}

/// False if a reading is far from the set point or from the expected force.
bool is_quiet(const ForceHoldConfig& config, const ForceHoldState& state,
              const ForceHoldInput& input) {
  return std::abs(input.setpoint_n - input.force_n) <= config.band_n &&
         (!state.active || std::abs(input.force_n - state.force_n) <= config.quiet_n);
}

}  // namespace

std::optional<double> hold_force(const ForceHoldConfig& config, ForceHoldState& state,
                                 const ForceHoldInput& input) {
  const double quantum_m = input.quantum_m;
  const double z_m = quantum_m * std::round(input.z_m / quantum_m);
  if (state.active) predict(state, input, z_m);
  if (input.fresh || !state.active) {
    if (!is_quiet(config, state, input)) {
      state.active = false;
      return std::nullopt;
    }
    if (state.active)
      correct(config, state, input);
    else
      begin(state, input, z_m);
  }
  choose_target(config, state, input,
                input.setpoint_n - (state.force_n + state.drift_nps * config.lead_s));
  const double left_m = state.target_m - input.z_m;
  return std::abs(left_m) < middle_share * quantum_m ? 0 : left_m / config.step_s;
}

}  // namespace weft::recipes
