#pragma once
// Moves of trials and of the final steps, with their time limits and errors. The checker and the
// forecast examine the same moves that the engine commands.

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

/// Leg `leg` of the exploration's path, shifted by `offset_m`; leg < path_m.size().
PathLeg path_leg(const Exploration& exploration, std::size_t leg, Vec2 offset_m = {});

/// Stage positions with the probe over `point_m` of the fabric, `clearance_m` above the plate. The
/// rotary stages are upright, or at the level angles of the rig.
Result<Joints> over(const RigLimits& limits, Vec2 point_m, double clearance_m);

/// Stage positions above the start of the trial's path, at the clear height.
Result<Joints> above_start(const Plan& plan, const TrialSpec& trial);
/// The start of the trial's path in the fabric frame.
Vec2 start_of(const Plan& plan, const TrialSpec& trial);

/// Moves every axis except z to `joints`, at transfer speed.
std::vector<AxisMove> transfer(const Plan& plan, const Joints& joints);

/// Moves of x and y along a leg. Speeds are in proportion to the distances, so that both arrive
/// together. Errors: those of over(), on a rig with level angles.
Result<std::vector<AxisMove>> leg_moves(const Plan& plan, const PathLeg& leg, double speed_mps);

/// Speed that z reaches on a descent driven with `speed_mps`.
double driven_speed(const RigLimits& limits, double speed_mps);

/// Speed of the descent until the taxels detect the touch. z moves at most 0.1 mm between two
/// frames and the response to them. If frames are missing or do not change, z moves no deeper than
/// a press may until that is detected.
double touch_speed_mps(const Plan& plan);

/// The stop that carries the probe is stiff: z rises to it at this speed [m/s].
inline constexpr double lighten_speed_mps = 0.05e-3;

/// Time limit of a move that should take `expected_s` [s].
double move_timeout_s(double expected_s);

/// Time from one end of the axis to the other, for rotary axes at their limit [s]. The position of
/// the stage is not known at planning.
double full_travel_s(const RigLimits& limits, Axis axis, double speed_mps);

/// Time limit of a retract to the clear height from any z [s].
double retreat_timeout_s(const Plan& plan);

/// Error of a step that timed out; `place` names it. `awaited`: the missing answer, if known.
Error step_timed_out(std::string place, const std::optional<Error>& awaited = {});

/// Every allowed attempt was bad; `last` is the reason of the last one.
Error still_bad(std::string place, std::uint32_t takes, const Error& last);

/// The probe came down to the plate and no fabric carried it.
Error nothing_bears(std::string place);

/// z reached its limit before the force came to `wanted_n`.
Error force_not_reached(std::string place, double wanted_n);

/// In phase S or E the force was not the weight of the probe.
Error not_at_rest(std::string place, Phase phase, double mean_n, double weight_n);

/// The stage cannot reach the rest height on this fabric.
Error rest_out_of_travel(std::string place, double rest_z_m);

/// Lowest z of an approach: a little below the surface of the bare plate, within travel.
double lowest_z_m(const RigLimits& limits);

// Final steps of a recipe, by the outcome of the campaign.

bool is_empty(const Finally& finally);

/// In order; empty if the recipe has no steps for such an end.
const std::vector<LastStep>& steps_after(const Finally& finally, Outcome campaign);

/// The moves of a park, none of a wait; z stays where it is.
std::vector<AxisMove> list_moves(const Plan& plan, const LastStep& step);

/// Duration of the step [s]: exact for a wait, the maximum for a park.
double duration_s(const Plan& plan, const LastStep& step);

/// Warnings about lists with waits that use up the budget alone. The duration of a park depends on
/// the stage positions.
std::vector<Diagnostic> warnings_about_budget(const Finally& finally);

/// The budget ended before all final steps were done.
Error budget_used_up(std::string place, double budget_s);

}  // namespace weft::recipes
