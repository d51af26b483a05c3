#pragma once
// Time, bytes and envelope of a plan, from the moves that the engine will command.

#include "recipes/engine/plan.hpp"

namespace weft::recipes {

Forecast forecast(const Plan& plan);

/// Expected time of one trial [s], coming from `from_m` (fabric frame) at the clear height.
/// Changing the cloth by hand is not in it.
double trial_duration_s(const Plan& plan, const Exploration& exploration, Vec2 from_m);

/// Of every trial of the plan, in order, the way to the first among it; their sum is the
/// forecast's trials_s() [s].
std::vector<double> trial_durations_s(const Plan& plan);

/// Time of phase M [s]: the probe stops at every corner.
double motion_duration_s(const Exploration& exploration, double acceleration_mps2);

}  // namespace weft::recipes
