#include "recipes/maintenance/maintenance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "recipes/engine/motion.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::recipes {
namespace {

constexpr double tilt_ramp_s = 1;  // a rotary stage reaches its speed within this time

std::string with_unit(Axis axis, double value) {
  return is_linear(axis) ? std::to_string(value / m_per_mm) + " mm"
                         : std::to_string(value / rad_per_deg) + " deg";
}

double top_speed(const RigLimits& limits, Axis axis) {
  return is_linear(axis) ? limits.max_speed_mps : limits.max_tilt_speed_radps;
}

double way_s(const RigLimits& limits, Axis axis, double way, double speed) {
  return is_linear(axis) ? move_duration_s(way, speed, limits.max_acceleration_mps2)
                         : way / speed + tilt_ramp_s;
}

/// Plans one order and collects its legs.
class MaintenancePlanner {
 public:
  MaintenancePlanner(const RigLimits& limits, const BenchFound& found) : found_(found) {
    plan_.limits = limits;
    plan_.begins_up = is_up(found.joints[Axis::z]);
  }

  Result<MaintenancePlan> plan(const MaintenanceOrder& order) {
    Status ok;
    if (order.kind == MaintenanceKind::retract) lift();
    if (order.kind == MaintenanceKind::park) ok = park();
    if (order.kind == MaintenanceKind::jog) ok = jog(order.axis, order.distance);
    if (!ok) return pass(ok.error());
    return std::move(plan_);
  }

 private:
  [[nodiscard]] bool is_homed(Axis axis) const { return found_.homed[index(axis)]; }
  [[nodiscard]] bool is_up(double z_m) const {
    return is_homed(Axis::z) && z_m <= plan_.limits.clear_z_m() + travel_rounding;
  }

  /// A probe that is up already stays at its height: it must not be lowered.
  void lift() {
    if (plan_.begins_up) return;
    const double from = found_.joints[Axis::z];
    if (is_homed(Axis::z)) return add_lift(plan_.limits.clear_z_m(), plan_.limits.max_speed_mps);
    // Positions have no origin yet, so the travel limits do not apply.
    plan_.is_relative = true;
    constexpr double anywhere = std::numeric_limits<double>::max();
    plan_.limits.geometry.travel[index(Axis::z)] = {-anywhere, anywhere};
    add_lift(from - plan_.limits.clearance_m, jog_speed_share * plan_.limits.max_speed_mps);
  }

  void add_lift(double target_m, double speed_mps) {
    MaintenanceLeg leg = leg_of({Axis::z, target_m, speed_mps, plan_.is_relative});
    leg.lifts = true;
    leg.ends_up = is_up(target_m);
    plan_.legs.push_back(std::move(leg));
  }

  [[nodiscard]] MaintenanceLeg leg_of(const AxisMove& move) const {
    const double way = std::abs(move.target - found_.joints[move.axis]);
    return {.moves = {move},
            .timeout_s = move_timeout_s(way_s(plan_.limits, move.axis, way, move.speed))};
  }

  Status park() {
    for (const Axis axis : all_axes)
      if (Status homed = require_homed(axis); !homed) return homed;
    lift();
    MaintenanceLeg across{.ends_up = true};
    for (const Axis axis : {Axis::x, Axis::y, Axis::rx, Axis::ry}) {
      if (plan_.limits.geometry.is_fixed(axis)) continue;
      const AxisMove move{axis, plan_.limits.park[axis], top_speed(plan_.limits, axis)};
      if (std::abs(move.target - found_.joints[axis]) <= travel_rounding) continue;
      across.timeout_s = std::max(across.timeout_s, leg_of(move).timeout_s);
      across.moves.push_back(move);
    }
    if (!across.moves.empty()) plan_.legs.push_back(std::move(across));
    return {};
  }

  Status jog(Axis axis, double distance) {
    if (plan_.limits.geometry.is_fixed(axis)) return no_stage(axis);
    if (Status homed = require_homed(axis); !homed) return homed;
    const double target = found_.joints[axis] + distance;
    const double speed = jog_speed_share * top_speed(plan_.limits, axis);
    if (Status inside = check_target(axis, target); !inside) return inside;
    if (axis == Axis::z && distance < 0) {
      add_lift(target, speed);
      return {};
    }
    if (Status felt = limit_force(); !felt) return felt;
    MaintenanceLeg leg = leg_of({axis, target, speed});
    leg.lowers = axis == Axis::z;
    leg.ends_up = leg.lowers ? is_up(target) : plan_.begins_up;
    if (leg.lowers)
      leg.timeout_s =
          move_timeout_s(way_s(plan_.limits, axis, distance, driven_speed(plan_.limits, speed)));
    plan_.legs.push_back(std::move(leg));
    return {};
  }

  [[nodiscard]] Status require_homed(Axis axis) const {
    if (is_homed(axis)) return {};
    return fail({.code = Errc::wrong_state,
                 .where = std::string(to_string(axis)),
                 .what = "stage not homed",
                 .expected = "homed",
                 .hint = "Retract the probe; the next run homes the stages"});
  }

  [[nodiscard]] Status no_stage(Axis axis) const {
    return fail({.code = Errc::unsupported,
                 .where = std::string(to_string(axis)),
                 .what = "no stage for this axis",
                 .expected = "an axis that is the role of a device in the rig file",
                 .got = "fixed at " + with_unit(axis, found_.joints[axis])});
  }

  [[nodiscard]] Status check_target(Axis axis, double target) const {
    Range range = plan_.limits.geometry.travel[index(axis)];
    if (axis == Axis::z) range.max = std::min(range.max, lowest_jog_m());
    if (within(range, {target, target})) return {};
    return fail({.code = Errc::range,
                 .where = std::string(to_string(axis)),
                 .what = "jog ends outside the travel or below the plate",
                 .expected = with_unit(axis, range.min) + " to " + with_unit(axis, range.max),
                 .got = with_unit(axis, target),
                 .hint = "Jog a shorter distance"});
  }

  /// Without a force sensor nothing stops a jog on the fabric.
  [[nodiscard]] double lowest_jog_m() const {
    return plan_.limits.has_wrench ? lowest_z_m(plan_.limits) : plan_.limits.clear_z_m();
  }

  [[nodiscard]] Status require_up() const {
    if (plan_.begins_up) return {};
    return fail({.code = Errc::unsupported,
                 .where = "wrench",
                 .what = "probe too low for a jog without a force sensor",
                 .expected = "z at the clear height",
                 .hint = "Retract the probe first"});
  }

  /// The limit is relative to the force before the jog. A sensor that was switched on since the
  /// last trial has no bias. The sum of both stays under the rig's cap.
  Status limit_force() {
    if (!plan_.limits.has_wrench) return require_up();
    const double cap_n = plan_.limits.force_cap_n;
    if (!found_.force_n || !(*found_.force_n < cap_n))
      return fail({.code = Errc::measurement,
                   .where = "wrench",
                   .what = found_.force_n ? "force too large for a jog" : "no force reading",
                   .expected = "below " + std::to_string(cap_n) + " N",
                   .got = found_.force_n ? std::to_string(*found_.force_n) + " N" : "none",
                   .hint = "Retract the probe and check the force sensor"});
    plan_.limits.force_cap_n = std::min(jog_force_n, cap_n - *found_.force_n);
    return {};
  }

  BenchFound found_;
  MaintenancePlan plan_;
};

/// One call of step(): collects the next state and the effects.
class MaintenanceMachine {
 public:
  MaintenanceMachine(const MaintenancePlan& plan, MaintenanceState state, TimePoint now)
      : plan_(plan), state_(std::move(state)), now_(now) {}

  MaintenanceTransition run(const Event& event) {
    if (state_.step != Step::done) std::visit([this](const auto& e) { on(e); }, event);
    return {std::move(state_), std::move(effects_)};
  }

 private:
  using Step = MaintenanceState::Step;

  template <class Other>
  void on(const Other&) {}  // events that only a campaign uses are ignored

  void on(const Start&) {
    if (state_.step != Step::ready) return;
    state_.step = Step::moving;
    state_.is_up = plan_.begins_up;
    begin_leg();
  }
  void on(const MotionDone& event) {
    if (!answers(event.ticket)) return;
    state_.is_up = leg().ends_up;
    ++state_.leg;
    begin_leg();
  }
  void on(const MotionLost& event) {
    if (answers(event.ticket)) give_up();
  }
  void on(const ForceReached& event) {
    if (!answers(event.ticket)) return;
    note({.code = Errc::measurement,
          .where = "jog",
          .what = "probe met an obstacle on its way down, so z stopped",
          .expected = "below " + std::to_string(plan_.limits.force_cap_n) + " N"});
    end(Outcome::failed, rest_fact());
  }
  void on(const TimerExpired& event) {
    if (!answers(event.ticket)) return;
    note(step_timed_out("maintenance", event.awaited));
    give_up();
  }
  void on(const Fault& event) {
    note(event.error);
    if (!state_.lifting) give_up();
  }
  void on(const GuardTripped& event) {
    if (event.trip.action == GuardAction::hold) return;
    note(event.trip.error);
    if (state_.lifting) return;
    if (event.trip.action == GuardAction::end_campaign) return give_up();
    cut(Outcome::failed);
  }
  void on(const StopRequested&) { cut(Outcome::stopped); }
  void on(const AbortRequested&) { cut(Outcome::aborted); }
  void on(const HaltRequested&) { cut(Outcome::aborted); }

  void begin_leg() {
    state_.lifting = false;
    ++state_.ticket;
    if (state_.leg == plan_.legs.size()) return end(Outcome::complete, rest_fact());
    if (state_.error && !leg().lifts) return end(Outcome::failed, rest_fact());
    state_.lifting = leg().lifts;
    if (leg().lowers) state_.is_up = false;
    effects_.push_back(ArmTimer{state_.ticket, now_ + from_seconds(leg().timeout_s)});
    const AxisMove& first = leg().moves.front();
    if (leg().lowers)
      effects_.push_back(
          Descend{state_.ticket, first.target, first.speed, plan_.limits.force_cap_n});
    else
      effects_.push_back(MoveTo{state_.ticket, leg().moves});
  }

  void cut(Outcome outcome) {
    effects_.push_back(StopMotion{});
    end(outcome, rest_fact());
  }
  void give_up() {
    effects_.push_back(StopMotion{});
    end(Outcome::failed, RigFact::unknown);
  }
  void end(Outcome outcome, RigFact rig) {
    state_.step = Step::done;
    state_.lifting = false;
    ++state_.ticket;
    effects_.push_back(MaintenanceDone{outcome, rig, state_.error});
  }

  [[nodiscard]] RigFact rest_fact() const {
    return state_.is_up ? RigFact::safe : RigFact::holding;
  }
  [[nodiscard]] const MaintenanceLeg& leg() const { return plan_.legs[state_.leg]; }
  [[nodiscard]] bool answers(Ticket ticket) const {
    return state_.step == Step::moving && ticket == state_.ticket;
  }
  void note(Error error) {
    if (!state_.error) state_.error = std::move(error);
  }

  const MaintenancePlan& plan_;
  MaintenanceState state_;
  TimePoint now_;
  std::vector<MaintenanceEffect> effects_;
};

}  // namespace

std::string_view to_string(MaintenanceKind kind) {
  constexpr std::array<std::string_view, 3> names{"retract", "park", "jog"};
  return names[static_cast<std::size_t>(kind)];
}

Status check_order(const MaintenanceOrder& order) {
  if (order.kind != MaintenanceKind::jog) return {};
  const double longest = is_linear(order.axis) ? longest_jog_m : longest_jog_rad;
  const double way = std::abs(order.distance);
  if (way > 0 && way <= longest + travel_rounding) return {};
  return fail({.code = Errc::range,
               .where = "/params/distance",
               .what = "jog distance out of range",
               .expected = "not 0, and at most " + with_unit(order.axis, longest),
               .got = with_unit(order.axis, order.distance)});
}

Result<MaintenancePlan> plan_maintenance(const RigLimits& limits, const MaintenanceOrder& order,
                                         const BenchFound& found) {
  if (Status ok = check_order(order); !ok) return pass(ok.error());
  return MaintenancePlanner(limits, found).plan(order);
}

MaintenanceTransition step(const MaintenancePlan& plan, const MaintenanceState& state,
                           const Event& event, TimePoint now) {
  return MaintenanceMachine(plan, state, now).run(event);
}

}  // namespace weft::recipes
