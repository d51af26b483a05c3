#pragma once
// Moves of trials and of a recipe's last steps, with their time limits and errors. The engine
// commands the same moves that the checker and the forecast examine.

#include <cstddef>
#include <string>
#include <vector>

#include "recipes/engine/engine.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::recipes {

/// One straight piece of the path of phase M, in the fabric frame.
struct PathLeg {
  Vec2 from_m;
  Vec2 to_m;
  double length_m = 0;
};

/// Leg `leg` of the exploration's path, moved by `offset_m`; leg < path_m.size().
PathLeg path_leg(const Exploration& exploration, std::size_t leg, Vec2 offset_m = {});

/// Stages with the probe over `point_m` of the cloth, `clearance_m` above the plate: upright, or
/// where the rig's level has the rotary stages.
Result<Joints> over(const RigLimits& limits, Vec2 point_m, double clearance_m);

/// Stages above where the trial's path starts, at the clear height.
Result<Joints> above_start(const Plan& plan, const TrialSpec& trial);
/// That point in the fabric frame.
Vec2 start_of(const Plan& plan, const TrialSpec& trial);

/// Every axis but z to `joints`, at transfer speed.
std::vector<AxisMove> transfer(const Plan& plan, const Joints& joints);

/// x and y along a leg. Speeds are in proportion to the distances, so that both arrive together.
/// Errors: those of over(), on a rig with a level.
Result<std::vector<AxisMove>> leg_moves(const Plan& plan, const PathLeg& leg, double speed_mps);

/// What z reaches on a way down that is driven with `speed_mps`.
double driven_speed(const RigLimits& limits, double speed_mps);

/// Of the way down on which the taxels find the touch: they are too slow for more than 0.1 mm of
/// it between two frames and the answer to them; and until frames that do not come or do not
/// change are noticed, z goes no further than a press may.
double touch_speed_mps(const Plan& plan);

/// The stop that carries the probe is stiff: z rises to it at this speed [m/s].
inline constexpr double lighten_speed_mps = 0.05e-3;

/// How long a move that should take `expected_s` may take before its step has failed.
double move_timeout_s(double expected_s);

/// From one end of the axis to the other, rotary axes at their limit: where the stage stands is not
/// known to a plan.
double full_travel_s(const RigLimits& limits, Axis axis, double speed_mps);

/// How long the probe may take up to the clear height, from wherever z stands.
double retreat_timeout_s(const Plan& plan);

/// A step whose timer came first; `place` says which. `awaited`: what the bench knows of it.
Error step_timed_out(std::string place, const std::optional<Error>& awaited = {});

/// Every take that the recipe allows was bad; `last`: why the last one was.
Error still_bad(std::string place, std::uint32_t takes, const Error& last);

/// The probe came down to the plate and no cloth bore it.
Error nothing_bears(std::string place);

/// z went as far as it may and the force did not come to `wanted_n`.
Error force_not_reached(std::string place, double wanted_n);

/// In phase S or E the cloth did not bear just the probe's weight.
Error not_at_rest(std::string place, Phase phase, double mean_n, double weight_n);

/// The height at rest over this cloth is one that the stage does not reach.
Error rest_out_of_travel(std::string place, double rest_z_m);

/// Lowest z an approach may go to: a little under the bare plate's surface, within travel.
double lowest_z_m(const RigLimits& limits);

// What a recipe has done finally, by how the campaign ended.

bool is_empty(const Finally& finally);

/// In order; none where the recipe says nothing of such an end.
const std::vector<LastStep>& steps_after(const Finally& finally, Outcome campaign);

/// The moves of a park, none of a wait; z stays where it is.
std::vector<AxisMove> list_moves(const Plan& plan, const LastStep& step);

/// How long the step takes [s]: a wait exactly, a park at most.
double duration_s(const Plan& plan, const LastStep& step);

/// Warnings of lists whose waits alone leave none of the budget. How long a park takes depends on
/// where the stages stand.
std::vector<Diagnostic> warnings_about_budget(const Finally& finally);

/// What the budget left no time for.
Error budget_used_up(std::string place, double budget_s);

}  // namespace weft::recipes
