#include "recipes/alignment/alignment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "protocols/base/time.hpp"
#include "recipes/engine/motion.hpp"

namespace weft::recipes {
namespace {

/// Distance to the surface while crossing to the next point, added to its possible rise.
constexpr double hover_m = 3e-3;
/// A descent ends without contact at this depth below the lowest possible surface.
constexpr double search_margin_m = 1e-3;
constexpr double zero_s = 2.5;  // time to take the bias, before the timer's grace period

double distance_m(Vec2 a, Vec2 b) {
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
}

std::string in_um(double metres) {
  return std::to_string(metres / m_per_um) + " um";
}

std::string in_deg(double rad) {
  return std::to_string(rad / rad_per_deg) + " deg";
}

/// One call of step(): collects the next state and the effects.
class Aligner {
 public:
  Aligner(const AlignPlan& plan, AlignState state, TimePoint now)
      : plan_(plan), state_(std::move(state)), now_(now) {}

  AlignTransition run(const Event& event) {
    if (state_.step != AlignStep::done) std::visit([this](const auto& e) { on(e); }, event);
    return {std::move(state_), std::move(effects_)};
  }

 private:
  // ---- events ----

  template <class Other>
  void on(const Other&) {}  // events that only a campaign uses are ignored

  void on(const Start&) {
    if (state_.step != AlignStep::ready) return;
    state_.tilts = within_reach({});
    enter(AlignStep::clearing, travel_s(Axis::z));
    move({{Axis::z, top_z_m(), plan_.transfer_speed_mps}});
  }

  void on(const Biased& event) {
    if (answers(event.ticket, AlignStep::biasing)) approach();
  }

  void on(const MotionDone& event) {
    if (event.ticket != state_.ticket) return;
    switch (state_.step) {
      case AlignStep::clearing:
        return turn();
      case AlignStep::turning:
        return bias();
      case AlignStep::crossing:
        return approach();
      case AlignStep::approaching:
      case AlignStep::touching:
        return give_up(no_contact());
      case AlignStep::backing:
        return touch();
      case AlignStep::lifting:
        return state_.point < plan_.points_m.size() ? cross() : turn();
      case AlignStep::retracting:
        return finish(Cleanup::done);
      default:
        return;
    }
  }

  void on(const ForceReached& event) {
    if (answers(event.ticket, AlignStep::approaching)) return back_off(event.z_m);
    if (answers(event.ticket, AlignStep::touching)) touched(event.z_m);
  }

  void on(const TimerExpired& event) {
    if (event.ticket != state_.ticket || state_.step == AlignStep::ready) return;
    if (state_.step != AlignStep::retracting)
      return give_up(step_timed_out(place(), event.awaited));
    note(step_timed_out(place()));
    give_up_retreat();
  }

  /// Only a retract still waits for its motion: the fault has ended any other step.
  void on(const MotionLost& event) {
    if (answers(event.ticket, AlignStep::retracting)) give_up_retreat();
  }

  void on(const Fault& event) { give_up(event.error); }

  /// Some guards only require that the work ends (such as the disk guard); they do not apply here.
  void on(const GuardTripped& event) {
    const GuardAction action = event.trip.action;
    if (action != GuardAction::hold && action != GuardAction::finish_trial)
      give_up(event.trip.error);
  }

  void on(const AbortRequested&) { cut_short(Outcome::aborted); }

  void on(const HaltRequested&) {
    state_.outcome = Outcome::aborted;
    emit(StopMotion{});
    finish(Cleanup::skipped, RigFact::holding);
  }

  // ---- a round ----

  /// The probe is at the top: turn the rotary stages and move over the first point.
  void turn() {
    state_.point = 0;
    state_.touches.clear();
    const Result<Joints> joints = over_point();
    if (!joints) return give_up(joints.error());
    double longest_s = 0;
    std::vector<AxisMove> moves;
    for (const Axis axis : {Axis::x, Axis::y, Axis::rx, Axis::ry}) {
      if (plan_.limits.geometry.is_fixed(axis)) continue;
      moves.push_back({axis, (*joints)[axis], speed_of(axis)});
      longest_s = std::max(longest_s, travel_s(axis));
    }
    enter(AlignStep::turning, longest_s);
    move(std::move(moves));
  }

  void bias() {
    enter(AlignStep::biasing, zero_s);
    emit(BiasSensors{state_.ticket});
  }

  void cross() {
    const Result<Joints> joints = over_point();
    if (!joints) return give_up(joints.error());
    enter(AlignStep::crossing, std::max(travel_s(Axis::x), travel_s(Axis::y)));
    move({{Axis::x, (*joints)[Axis::x], plan_.transfer_speed_mps},
          {Axis::y, (*joints)[Axis::y], plan_.transfer_speed_mps}});
  }

  void approach() {
    const double surface_z_m = plan_.limits.geometry.surface_z_m;
    const double lowest_m =
        (state_.point == 0 ? surface_z_m + plan_.rise_m() : state_.last_z_m + step_rise_m()) +
        search_margin_m;
    descend(AlignStep::approaching, lowest_m, plan_.approach_speed_mps, lowest_m - top_z_m());
  }

  void back_off(double z_m) {
    state_.last_z_m = z_m;
    enter(AlignStep::backing, move_s(plan_.back_off_m, plan_.touch_speed_mps));
    move({{Axis::z, z_m - plan_.back_off_m, plan_.approach_speed_mps}});
  }

  void touch() {
    descend(AlignStep::touching, state_.last_z_m + search_margin_m, plan_.touch_speed_mps,
            plan_.back_off_m + search_margin_m);
  }

  void touched(double z_m) {
    const Result<Joints> joints = over_point();
    if (!joints) return give_up(joints.error());
    Joints at = *joints;
    at[Axis::z] = z_m;
    const ProbePose pose = forward(plan_.limits.geometry, at);
    state_.touches.push_back({pose.contact_m, pose.clearance_m});
    state_.last_z_m = z_m;
    ++state_.point;
    if (state_.point < plan_.points_m.size()) return lift(z_m - step_rise_m() - hover_m);
    check_round();
  }

  /// The round has ended: fit the plane and check whether it is level.
  void check_round() {
    const Result<TiltFound> found = evaluate_plane();
    if (!found) return give_up(found.error());
    state_.rounds.push_back(*found);
    if (found->lean_rad <= plan_.tolerance_rad) return retract();
    if (state_.rounds.size() > plan_.most_turns) return give_up(not_level(*found));
    if (auto refused = out_of_travel(found->level)) return give_up(std::move(*refused));
    state_.tilts = within_reach(found->level);
    lift(top_z_m());
  }

  Result<TiltFound> evaluate_plane() {
    const Result<PlaneFit> plane = fit_plane(state_.touches, plan_.resolution_m);
    if (!plane) return pass(plane.error());
    if (plane->residual_worst_m > plan_.largest_residual_m)
      return fail({.code = Errc::measurement,
                   .where = "alignment",
                   .what = "surface not flat",
                   .expected = "residuals of at most " + in_um(plan_.largest_residual_m),
                   .got = in_um(plane->residual_worst_m),
                   .hint = "Remove the fabric, clean plate and probe, tighten the plate"});
    return compute_tilt(*plane, state_.tilts);
  }

  void lift(double z_m) {
    const Range& z = plan_.limits.geometry.travel[index(Axis::z)];
    enter(AlignStep::lifting, travel_s(Axis::z));
    move({{Axis::z, std::max(z_m, z.min), plan_.transfer_speed_mps}});
  }

  // ---- ends ----

  void retract() {
    enter(AlignStep::retracting, travel_s(Axis::z));
    move({{Axis::z, top_z_m(), plan_.transfer_speed_mps}});
  }

  void give_up(Error error) {
    note(std::move(error));
    cut_short(Outcome::failed);
  }

  /// A retract that is in progress continues.
  void cut_short(Outcome outcome) {
    if (state_.step == AlignStep::ready) {
      state_.outcome = outcome;
      return finish(Cleanup::skipped, RigFact::holding);
    }
    if (state_.outcome == Outcome::complete) state_.outcome = outcome;
    if (state_.step == AlignStep::retracting) return;
    emit(StopMotion{});
    retract();
  }

  /// The probe is not known to be up. The caller has recorded the reason.
  void give_up_retreat() {
    emit(StopMotion{});
    finish(Cleanup::failed, RigFact::unknown);
  }

  void finish(Cleanup cleanup, RigFact rig = RigFact::safe) {
    if (cleanup == Cleanup::failed) state_.outcome = Outcome::failed;
    state_.step = AlignStep::done;
    ++state_.ticket;
    emit(AlignDone{state_.outcome, cleanup, rig, state_.error});
  }

  // ---- helpers ----

  void emit(AlignEffect effect) { effects_.push_back(std::move(effect)); }
  void move(std::vector<AxisMove> moves) { emit(MoveTo{state_.ticket, std::move(moves)}); }

  void enter(AlignStep step, double expected_s) {
    state_.step = step;
    ++state_.ticket;
    emit(ArmTimer{state_.ticket, now_ + from_seconds(move_timeout_s(expected_s))});
  }

  void descend(AlignStep step, double lowest_m, double speed_mps, double way_m) {
    const Range& z = plan_.limits.geometry.travel[index(Axis::z)];
    enter(step, move_s(way_m, driven_speed(plan_.limits, speed_mps)));
    emit(Descend{state_.ticket, std::min(lowest_m, z.max), speed_mps, plan_.contact_force_n});
  }

  [[nodiscard]] bool answers(Ticket ticket, AlignStep step) const {
    return state_.step == step && ticket == state_.ticket;
  }

  void note(Error error) {
    if (!state_.error) state_.error = std::move(error);
  }

  /// Stage positions over the current point, with z at the nominal plate.
  [[nodiscard]] Result<Joints> over_point() const {
    return inverse(plan_.limits.geometry,
                   {plan_.points_m[state_.point], 0, state_.tilts.rx_rad, state_.tilts.ry_rad});
  }

  /// Above the plate at any tilt that it may have.
  [[nodiscard]] double top_z_m() const { return plan_.limits.clear_z_m() - plan_.rise_m(); }

  /// Largest rise of the surface between the previous point and the current one [m].
  [[nodiscard]] double step_rise_m() const {
    const std::vector<Vec2>& p = plan_.points_m;
    return distance_m(p[state_.point], p[state_.point - 1]) * std::tan(plan_.largest_tilt_rad);
  }

  [[nodiscard]] double speed_of(Axis axis) const {
    return is_linear(axis) ? plan_.transfer_speed_mps : plan_.limits.max_tilt_speed_radps;
  }

  [[nodiscard]] double travel_s(Axis axis) const {
    return full_travel_s(plan_.limits, axis, plan_.transfer_speed_mps);
  }

  [[nodiscard]] double move_s(double distance_m, double speed_mps) const {
    return move_duration_s(distance_m, speed_mps, plan_.limits.max_acceleration_mps2);
  }

  [[nodiscard]] std::string place() const {
    return "alignment: round " + std::to_string(state_.rounds.size() + 1) + ", touch " +
           std::to_string(state_.point + 1) + ": " + std::string(to_string(state_.step));
  }

  [[nodiscard]] Error no_contact() const {
    return {
        .code = Errc::measurement,
        .where = place(),
        .what = "plate not found",
        .expected = "contact within the largest tilt",
        .got = "none",
        .hint = "Check plate.surface_z_mm, the sign of the force sensor and the tilt of the plate"};
  }

  [[nodiscard]] Error not_level(const TiltFound& found) const {
    return {.code = Errc::measurement,
            .where = "alignment",
            .what = "plate not level after " + std::to_string(plan_.most_turns) + " corrections",
            .expected = "at most " + in_deg(plan_.tolerance_rad),
            .got = in_deg(found.lean_rad),
            .hint = "Check sign and scale of the rotary stages and the mount of the plate"};
  }

  /// If an axis has no stage, the tilt about it is only measured.
  [[nodiscard]] std::optional<Error> out_of_travel(const Tilts& level) const {
    const auto& travel = plan_.limits.geometry.travel;
    for (const auto& [axis, angle] :
         {std::pair{Axis::rx, level.rx_rad}, {Axis::ry, level.ry_rad}}) {
      const Range& range = travel[index(axis)];
      const bool fixed = plan_.limits.geometry.is_fixed(axis);
      if (fixed ? std::abs(angle - range.min) <= plan_.tolerance_rad : range.contains(angle))
        continue;
      return Error{.code = fixed ? Errc::unsupported : Errc::range,
                   .where = "alignment",
                   .what = (fixed ? "plate tilted about an axis without a stage, "
                                  : "plate tilt beyond the travel of ") +
                           std::string(to_string(axis)),
                   .expected = in_deg(range.min) + " to " + in_deg(range.max),
                   .got = in_deg(angle),
                   .hint = "Level the plate by hand first"};
    }
    return std::nullopt;
  }

  /// A fixed axis keeps its angle.
  [[nodiscard]] Tilts within_reach(const Tilts& level) const {
    const auto& travel = plan_.limits.geometry.travel;
    const auto held = [&](Axis axis, double angle) {
      return plan_.limits.geometry.is_fixed(axis) ? travel[index(axis)].min : angle;
    };
    return {held(Axis::rx, level.rx_rad), held(Axis::ry, level.ry_rad)};
  }

  const AlignPlan& plan_;
  AlignState state_;
  TimePoint now_;
  std::vector<AlignEffect> effects_;
};

}  // namespace

std::string_view to_string(AlignStep step) {
  constexpr std::array<std::string_view, 11> names{"ready",    "clearing",    "turning", "biasing",
                                                   "crossing", "approaching", "backing", "touching",
                                                   "lifting",  "retracting",  "done"};
  return names[static_cast<std::size_t>(step)];
}

Result<TiltFound> compute_tilt(const PlaneFit& plane, const Tilts& stages) {
  const Result<Tilts> level = tilts_along(plane.normal());
  if (!level) return pass(level.error());
  TiltFound found;
  found.plane = plane;
  found.stages = stages;
  found.level = *level;
  found.tilt_x_rad = stages.rx_rad - level->rx_rad;
  found.tilt_y_rad = level->ry_rad - stages.ry_rad;
  found.lean_rad = angle_between(probe_axis(stages), plane.normal());
  found.lean_sd_rad = std::hypot(plane.slope_x_sd, plane.slope_y_sd);
  return found;
}

AlignTransition step(const AlignPlan& plan, const AlignState& state, const Event& event,
                     TimePoint now) {
  return Aligner(plan, state, now).run(event);
}

}  // namespace weft::recipes
