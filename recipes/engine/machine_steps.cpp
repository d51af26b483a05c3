// The steps of a trial in order: the effects of each and its time limit.

#include <algorithm>

#include "recipes/control/servo.hpp"
#include "recipes/engine/machine.hpp"

namespace weft::recipes {
namespace {

/// Within the slack of the mount the fabric carries the probe's weight. The force shows the ends of
/// the slack: shares of the weight, with a margin for the sensor's noise and bias.
constexpr double seated_share = 0.9, unloaded_share = 1.1, pressed_share = 1.2;
/// Largest sinking of the slack's lower end since the fabric carried the probe [m].
constexpr double most_sunk_m = 1e-3;
constexpr double bias_timeout_s = 10;

/// Largest overrun of z past the commanded end of its descent.
double past_the_end_m(const Approach& approach) {
  return run_on_m(std::max(approach.speed_mps, approach.seat_speed_mps));
}

/// From the clear height to the lowest z of a descent.
double deepest_way_m(const RigLimits& limits) {
  return lowest_z_m(limits) - limits.clear_z_m();
}

bool is_recording(Step step) {
  return step == Step::resting || step == Step::holding || step == Step::sliding ||
         step == Step::ending;
}

}  // namespace

void Machine::begin_trial(bool up_first) {
  const bool begins = state_.trial == state_.first_trial;
  if (const auto due = due_step(plan_, state_.trial, state_.operator_step, begins))
    return prompt_operator(*due);
  emit(TrialBegin{state_.trial});
  up_first ? clear() : mount();
}

void Machine::prompt_operator(std::size_t operator_step) {
  state_.operator_step = operator_step;
  enter(Step::awaiting_operator, to_seconds(longest_hold));
  emit(PromptOperator{state_.ticket, step_prompt(plan_, state_.trial, operator_step)});
}

void Machine::clear() {
  enter(Step::clearing, retreat_timeout_s(plan_));
  move({lift()});
}

void Machine::mount() {
  enter(Step::mounting, plan_.mount_timeout_s);
  const TrialSpec& spec = trial();
  emit(MountFabric{state_.ticket, plan_.fabrics[spec.fabric], spec.place, spec.seeds});
}

void Machine::position() {
  const Result<Joints> joints = above_start(plan_, trial());
  if (!joints) return fail_trial(joints.error());
  const std::vector<AxisMove> moves = transfer(plan_, *joints);
  double longest_s = 0;
  for (const AxisMove& m : moves) longest_s = std::max(longest_s, travel_s(m.axis));
  enter(Step::positioning, move_timeout_s(longest_s));
  move(moves);
}

void Machine::bias() {
  enter(Step::biasing, bias_timeout_s);
  emit(BiasSensors{state_.ticket});
}

void Machine::approach() {
  if (!by_depth())
    return descend(Step::approaching, plan_.approach.speed_mps, plan_.approach.contact_force_n);
  descend(Step::approaching, touch_speed_mps(plan_), 0);
}

void Machine::seat() {
  descend(Step::seating, plan_.approach.seat_speed_mps, seated_share * plan_.limits.probe_weight_n);
}

void Machine::lower_to_rest(double touch_z_m) {
  state_.rest_z_m = touch_z_m + plan_.limits.rest_travel_m;
  const Range& travel = plan_.limits.geometry.travel[index(Axis::z)];
  if (!travel.contains(state_.rest_z_m))
    return fail_trial(rest_out_of_travel(place(), state_.rest_z_m));
  // z still brakes from its descent and may have to return.
  const double speed = plan_.approach.seat_speed_mps;
  const double way_m = plan_.limits.rest_travel_m + past_the_end_m(plan_.approach);
  enter(Step::lowering, move_timeout_s(move_s(way_m, speed)));
  move({{Axis::z, state_.rest_z_m, speed}});
}

void Machine::press() {
  emit(SetPhase{Phase::none});
  if (by_depth()) return press_by_depth();
  if (force_n() == 0) return hover();
  hangs(force_n()) ? lighten() : hold_force();
}

/// Only the clear height is certain to be above a soft fabric.
void Machine::hover() {
  enter(Step::lifting, retreat_timeout_s(plan_));
  move({lift()});
}

void Machine::lighten() {
  ascend(Step::lifting, lighten_speed_mps, seated_share * plan_.limits.probe_weight_n,
         plan_.limits.rest_travel_m + most_sunk_m);
}

/// Presses to the depth below the touch of the taxels, at most as deep as the rig allows.
void Machine::press_by_depth() {
  const double depth_m = exploration().step(Phase::press).depth_m;
  const double target_m = state_.rest_z_m - plan_.limits.rest_travel_m + depth_m;
  const Range& travel = plan_.limits.geometry.travel[index(Axis::z)];
  if (!travel.contains(target_m)) return fail_trial(rest_out_of_travel(place(), target_m));
  const double speed = plan_.approach.seat_speed_mps;
  enter(Step::pressing, move_timeout_s(move_s(depth_m, speed)));
  move({{Axis::z, target_m, speed}});
}

void Machine::hold_force() {
  const PhaseStep& phase = exploration().step(Phase::press);
  enter(Step::pressing, plan_.settle.timeout_s);
  emit(HoldForce{state_.ticket, phase.force_n, phase.force_band_n, plan_.settle.dwell_s});
}

void Machine::slide() {
  emit(SetPhase{Phase::motion});
  state_.leg = 0;
  start_leg();
}

void Machine::next_leg() {
  ++state_.leg;
  if (state_.leg < exploration().path_m().size()) return start_leg();
  release();
}

void Machine::start_leg() {
  const PathLeg leg = path_leg(exploration(), state_.leg, trial().place.offset_m);
  const double speed = exploration().step(Phase::motion).speed_mps;
  const Result<std::vector<AxisMove>> moves = leg_moves(plan_, leg, speed);
  if (!moves) return fail_trial(moves.error());
  enter(Step::sliding, move_timeout_s(move_s(leg.length_m, speed)));
  move(*moves);
}

void Machine::release() {
  emit(SetPhase{Phase::none});
  if (by_depth()) return rest_again();
  emit(ReleaseForce{});
  const double weight_n = plan_.limits.probe_weight_n, speed = plan_.approach.seat_speed_mps;
  if (force_n() >= pressed_share * weight_n)
    return ascend(Step::releasing, speed, unloaded_share * weight_n, deepest_way_m(plan_.limits));
  // A probe held at about its weight is anywhere in the slack: go to the upper end.
  const double share = hangs(force_n()) ? seated_share : pressed_share;
  descend(Step::releasing, speed, share * weight_n);
}

/// Without a force sensor the probe returns to its rest height of phase S.
void Machine::rest_again() {
  const double speed = plan_.approach.seat_speed_mps;
  enter(Step::unloading, move_timeout_s(move_s(plan_.limits.most_press_depth_m, speed)));
  move({{Axis::z, state_.rest_z_m, speed}});
}

void Machine::unload(double slack_end_z_m) {
  const double rest_travel_m = plan_.limits.rest_travel_m, speed = plan_.approach.speed_mps;
  const double way_m = rest_travel_m + past_the_end_m(plan_.approach);
  enter(Step::unloading, move_timeout_s(move_s(way_m, speed)));
  move({{Axis::z, slack_end_z_m + (hangs(force_n()) ? rest_travel_m : -rest_travel_m), speed}});
}

void Machine::retract() {
  close_phase();
  enter(Step::retracting, retreat_timeout_s(plan_));
  move({lift()});
}

void Machine::record(Step step, Phase phase) {
  enter(step, exploration().step(phase).duration_s);
  emit(SetPhase{phase});
}

void Machine::descend(Step step, double speed_mps, double stop_force_n) {
  const double reached_mps = driven_speed(plan_.limits, speed_mps);
  enter(step, move_timeout_s(move_s(deepest_way_m(plan_.limits), reached_mps)));
  emit(Descend{state_.ticket, lowest_z_m(plan_.limits), speed_mps, stop_force_n});
}

bool Machine::hangs(double force_n) const {
  return force_n < seated_share * plan_.limits.probe_weight_n;
}

void Machine::ascend(Step step, double speed_mps, double stop_force_n, double way_m) {
  enter(step, move_timeout_s(move_s(way_m, driven_speed(plan_.limits, speed_mps))));
  emit(Ascend{state_.ticket, plan_.limits.clear_z_m(), speed_mps, stop_force_n});
}

void Machine::close_phase() {
  if (is_recording(state_.step)) emit(SetPhase{Phase::none});
}

std::string Machine::place() const {
  return format_trial(plan_, state_.trial) + ": " + std::string(to_string(state_.step));
}

}  // namespace weft::recipes
