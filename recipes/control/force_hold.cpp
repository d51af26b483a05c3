#include "recipes/control/force_hold.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace weft::recipes {
namespace {

/// A stage this share of a quantum from the middle of its own is left there.
constexpr double middle_share = 0.25;

void begin(ForceHoldState& state, const ForceHoldInput& input, double z_m) {
  state.active = true;
  state.force_n = input.force_n;
  state.age_s = 0;
  state.z_m = state.target_m = z_m;
}

/// What the force is now if all goes on as believed.
void predict(ForceHoldState& state, const ForceHoldInput& input, double z_m) {
  state.force_n += state.drift_nps * input.dt_s + input.stiffness_npm * (z_m - state.z_m);
  state.age_s += input.dt_s;
  state.z_m = z_m;
}

void correct(const ForceHoldConfig& config, ForceHoldState& state, const ForceHoldInput& input) {
  const double off_n = input.force_n - state.force_n;
  const double steady =
      config.pole_radps * std::sqrt(input.stiffness_npm / config.pole_stiffness_npm);
  const double w = std::clamp(std::max(steady, config.learning / state.age_s), config.slowest_radps,
                              config.fastest_radps);
  state.force_n += off_n * -std::expm1(-std::numbers::sqrt2 * w * input.dt_s);
  state.drift_nps += off_n * w * w * input.dt_s;
}

}  // namespace

std::optional<double> hold_force(const ForceHoldConfig& config, ForceHoldState& state,
                                 const ForceHoldInput& input) {
  const double quantum_m = input.quantum_m;
  const double z_m = quantum_m * std::round(input.z_m / quantum_m);
  const bool near = std::abs(input.setpoint_n - input.force_n) <= config.band_n;
  if (near && !state.active)
    begin(state, input, z_m);
  else
    predict(state, input, z_m);
  state.active = near && std::abs(input.force_n - state.force_n) <= config.quiet_n;
  if (!state.active) return std::nullopt;
  if (input.fresh) correct(config, state, input);

  const double ahead_n = state.force_n + state.drift_nps * config.lead_s;
  const double way_m = (input.setpoint_n - ahead_n) / input.stiffness_npm;
  if (std::abs(way_m) > quantum_m / 2)
    state.target_m = z_m + quantum_m * std::round(way_m / quantum_m);
  const double left_m = state.target_m - input.z_m;
  return std::abs(left_m) < middle_share * quantum_m ? 0 : left_m / config.step_s;
}

}  // namespace weft::recipes
