#include "recipes/engine/engine.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "recipes/engine/last_steps.hpp"
#include "recipes/engine/motion.hpp"
#include "recipes/engine/trial_end.hpp"

namespace weft::recipes {
namespace {

/// The cloth bears the probe from this share of its weight on: the rest is for sensor noise.
constexpr double seated_share = 0.9;
constexpr double bias_timeout_s = 10;

bool is_recording(Step step) {
  return step == Step::resting || step == Step::holding || step == Step::sliding ||
         step == Step::ending;
}

/// One call of step(): the next state and the effects grow here.
class Machine {
 public:
  Machine(const Plan& plan, const State& state, TimePoint now)
      : plan_(plan), state_(state), now_(now) {}

  Transition run(const Event& event) {
    if (state_.step != Step::done) std::visit([this](const auto& e) { on(e); }, event);
    return {std::move(state_), std::move(effects_)};
  }

 private:
  // ---- events ----

  void on(const Start& start) {
    if (state_.step != Step::ready) return;
    if (start.first_trial >= plan_.trials.size())
      return finish(Outcome::complete, Cleanup::skipped);
    state_.trial = state_.first_trial = start.first_trial;
    state_.rejected = start.rejected;
    begin_trial(true);
  }

  void on(const OperatorConfirmed& event) {
    if (!answers(event.ticket, Step::awaiting_operator)) return;
    ++state_.operator_step;
    begin_trial(true);
  }

  void on(const Mounted& event) {
    if (answers(event.ticket, Step::mounting)) position();
  }

  void on(const Biased& event) {
    if (answers(event.ticket, Step::biasing)) approach();
  }

  void on(const MotionDone& event) {
    if (event.ticket != state_.ticket) return;
    switch (state_.step) {
      case Step::clearing:
        return mount();
      case Step::positioning:
        return bias();
      case Step::approaching:
      case Step::seating:
        return fail_trial(nothing_bears(place()));
      case Step::lowering:
        return record(Step::resting, Phase::rest);
      case Step::sliding:
        return next_leg();
      case Step::releasing:
        return record(Step::ending, Phase::end);
      case Step::retracting:
        return end_trial(Cleanup::done);
      case Step::concluding:
        return next_last_step();
      default:
        return;
    }
  }

  void on(const ContactFound& event) {
    if (answers(event.ticket, Step::approaching)) return seat();
    if (answers(event.ticket, Step::seating)) lower_to_rest(event.z_m);
  }

  void on(const ForceSettled& event) {
    if (answers(event.ticket, Step::pressing)) record(Step::holding, Phase::press);
  }

  /// A recorded phase ends by its timer; any other step has failed to end by itself.
  void on(const TimerExpired& event) {
    if (event.ticket != state_.ticket) return;
    switch (state_.step) {
      case Step::ready:
        return;
      case Step::resting:
        return press();
      case Step::holding:
        return exploration().slides() ? slide() : release();
      case Step::ending:
        return retract();
      case Step::retracting:
        return give_up_retreat();
      case Step::held:
      case Step::awaiting_operator:
        return end_at_rest(Outcome::stopped);
      case Step::concluding:
        return last_step_timed_out();
      default:
        return fail_trial(step_timed_out(place()));
    }
  }

  void on(const TakeRejected& event) {
    if (plan_.repeat_bad && state_.step == Step::retracting) state_.bad_take = event.why;
  }

  // The axes come to rest while z goes back up, as in a trial that is cut short.
  void on(const EndSlide&) {
    if (state_.step != Step::sliding) return;
    const auto& vote = exploration().live_vote;
    if (!vote || !vote->stop_early) return;
    state_.ended_early = true;
    emit(StopMotion{});
    release();
  }

  void on(const Fault& event) {
    if (is_concluding()) return give_up_last(event.error, RigFact::unknown);
    note(event.error);
    state_.campaign_outcome = Outcome::failed;
    cut_short(Outcome::failed, event.error);
  }

  void on(const GuardTripped& event) {
    if (event.trip.action == GuardAction::hold) return;  // the cycle itself commands nothing
    if (event.trip.action == GuardAction::finish_trial) {
      note(event.trip.error);
      return on(StopRequested{});
    }
    const bool grave = event.trip.action == GuardAction::end_campaign;
    if (is_concluding())
      return give_up_last(event.trip.error, grave ? RigFact::unknown : RigFact::safe);
    if (grave) {
      note(event.trip.error);
      state_.campaign_outcome = Outcome::failed;
    } else if (between_trials()) {
      return;  // whoever is at work on the plate touches it
    }
    cut_short(Outcome::failed, event.trip.error);
  }

  void on(const PauseRequested& event) {
    if (state_.step == Step::ready || state_.step == Step::held || is_concluding()) return;
    if (state_.step == Step::awaiting_operator) return hold();
    state_.pause_requested = true;
    if (!event.at_once && state_.step > Step::mounting) return;
    if (state_.step == Step::retracting) return;
    state_.repeats = true;
    cut_short(Outcome::stopped, std::nullopt);
  }

  void on(const ResumeRequested&) {
    state_.pause_requested = false;
    if (state_.step == Step::held) begin_trial(true);
  }

  void on(const StopRequested&) {
    state_.stop_requested = true;
    if (between_trials()) return end_at_rest(Outcome::stopped);
    // Nothing has been touched yet: there is no repetition to finish.
    if (state_.step <= Step::mounting) {
      state_.campaign_outcome = Outcome::stopped;
      cut_short(Outcome::stopped, std::nullopt);
    }
  }

  void on(const AbortRequested&) {
    if (is_concluding()) return give_up_last(std::nullopt, RigFact::safe);
    if (state_.campaign_outcome != Outcome::failed) state_.campaign_outcome = Outcome::aborted;
    cut_short(Outcome::aborted, std::nullopt);
  }

  void on(const HaltRequested&) {
    const bool in_trial = state_.step != Step::ready && !between_trials() && !is_concluding();
    close_phase();
    emit(StopMotion{});
    if (in_trial)
      emit(TrialDone{state_.trial, Outcome::aborted, Cleanup::skipped, state_.trial_error});
    end(is_concluding() ? *state_.campaign_outcome : Outcome::aborted, Cleanup::skipped,
        RigFact::holding);
  }

  // ---- steps of a trial, in order ----

  /// What a person is asked for comes first; `up_first` where the stages may have been touched.
  void begin_trial(bool up_first) {
    const bool begins = state_.trial == state_.first_trial;
    if (const auto due = due_step(plan_, state_.trial, state_.operator_step, begins))
      return ask(*due);
    emit(TrialBegin{state_.trial});
    up_first ? clear() : mount();
  }

  void ask(std::size_t operator_step) {
    state_.operator_step = operator_step;
    enter(Step::awaiting_operator, to_seconds(longest_hold));
    emit(AskOperator{state_.ticket, ask_of(plan_, state_.trial, operator_step)});
  }

  void clear() {
    enter(Step::clearing, move_timeout_s(travel_s(Axis::z)));
    move({lift()});
  }

  void mount() {
    enter(Step::mounting, plan_.mount_timeout_s);
    const TrialSpec& spec = trial();
    emit(MountFabric{state_.ticket, plan_.fabrics[spec.fabric], spec.patch_seed, spec.index});
  }

  void position() {
    const Result<Joints> joints = above_start(plan_, exploration());
    if (!joints) return fail_trial(joints.error());
    const std::vector<AxisMove> moves = transfer(plan_, *joints);
    double longest_s = 0;
    for (const AxisMove& m : moves) longest_s = std::max(longest_s, travel_s(m.axis));
    enter(Step::positioning, move_timeout_s(longest_s));
    move(moves);
  }

  void bias() {
    enter(Step::biasing, bias_timeout_s);
    emit(BiasSensors{state_.ticket});
  }

  void approach() {
    descend(Step::approaching, plan_.approach.speed_mps, plan_.approach.contact_force_n);
  }

  void seat() {
    descend(Step::seating, plan_.approach.seat_speed_mps,
            seated_share * plan_.limits.probe_weight_n);
  }

  void lower_to_rest(double touch_z_m) {
    state_.rest_z_m = touch_z_m + plan_.limits.rest_travel_m;
    const Range& travel = plan_.limits.geometry.travel[index(Axis::z)];
    if (!travel.contains(state_.rest_z_m))
      return fail_trial(rest_out_of_travel(place(), state_.rest_z_m));
    const double speed = plan_.approach.seat_speed_mps;
    enter(Step::lowering, move_timeout_s(plan_.limits.rest_travel_m / speed));
    move({{Axis::z, state_.rest_z_m, speed}});
  }

  void press() {
    emit(SetPhase{Phase::none});
    const PhaseStep& phase = exploration().step(Phase::press);
    enter(Step::pressing, plan_.settle.timeout_s);
    emit(HoldForce{state_.ticket, phase.force_n, phase.force_band_n, plan_.settle.dwell_s});
  }

  void slide() {
    emit(SetPhase{Phase::motion});
    state_.leg = 0;
    start_leg();
  }

  void next_leg() {
    ++state_.leg;
    if (state_.leg < exploration().path_m().size()) return start_leg();
    release();
  }

  void start_leg() {
    const PathLeg leg = path_leg(exploration(), state_.leg);
    const double speed = exploration().step(Phase::motion).speed_mps;
    const Result<std::vector<AxisMove>> moves = leg_moves(plan_, leg, speed);
    if (!moves) return fail_trial(moves.error());
    const double expected_s =
        move_duration_s(leg.length_m, speed, plan_.limits.max_acceleration_mps2);
    enter(Step::sliding, move_timeout_s(expected_s));
    move(*moves);
  }

  void release() {
    emit(SetPhase{Phase::none});
    emit(ReleaseForce{});
    enter(Step::releasing, move_timeout_s(travel_s(Axis::z)));
    move({{Axis::z, state_.rest_z_m, plan_.approach.speed_mps}});
  }

  void retract() {
    close_phase();
    enter(Step::retracting, move_timeout_s(travel_s(Axis::z)));
    move({lift()});
  }

  /// A phase that ends by its timer and is recorded.
  void record(Step step, Phase phase) {
    enter(step, exploration().step(phase).duration_s);
    emit(SetPhase{phase});
  }

  void descend(Step step, double speed_mps, double stop_force_n) {
    const double target = lowest_z_m(plan_.limits);
    enter(step, move_timeout_s((target - plan_.limits.clear_z_m()) / speed_mps));
    emit(Descend{state_.ticket, target, speed_mps, stop_force_n});
  }

  // ---- ends ----

  void fail_trial(Error error) { cut_short(Outcome::failed, std::move(error)); }

  /// Ends the trial under way with a retreat. During a retreat the retreat goes on.
  void cut_short(Outcome outcome, std::optional<Error> error) {
    if (state_.step == Step::ready)
      return finish(state_.campaign_outcome.value_or(outcome), Cleanup::skipped, RigFact::holding);
    if (between_trials()) return end_at_rest(state_.campaign_outcome.value_or(outcome));
    if (state_.step == Step::retracting) return;
    state_.trial_outcome = outcome;
    if (error) note(*error);
    state_.trial_error = std::move(error);
    close_phase();
    emit(StopMotion{});
    retract();
  }

  void give_up_retreat() {
    emit(StopMotion{});
    note(step_timed_out(place()));
    state_.campaign_outcome = Outcome::failed;
    end_trial(Cleanup::failed);
  }

  void end_trial(Cleanup cleanup) {
    const Outcome outcome = judged(plan_, state_, place());
    const bool cut = std::exchange(state_.repeats, false) && outcome == Outcome::stopped;
    const bool again = cut || outcome == Outcome::rejected;
    const bool early = std::exchange(state_.ended_early, false) && outcome == Outcome::complete;
    if (!again) ++(outcome == Outcome::complete ? state_.completed : state_.failed);
    emit(TrialDone{state_.trial, outcome, cleanup, std::exchange(state_.trial_error, {}), early});
    state_.trial_outcome.reset();
    if (cleanup == Cleanup::failed) return finish(Outcome::failed, cleanup, RigFact::unknown);
    if (const auto end = again ? end_before_repeat(state_) : campaign_end(plan_, state_, outcome))
      return finish(*end, cleanup);
    if (!again) next_trial();
    if (std::exchange(state_.pause_requested, false)) return hold();
    begin_trial(false);
  }

  void hold() { enter(Step::held, to_seconds(longest_hold)); }

  void next_trial() {
    ++state_.trial;
    state_.rejected = 0;
    state_.operator_step = 0;
  }

  /// The campaign has ended but for what the recipe does finally, where the probe is up.
  void finish(Outcome outcome, Cleanup cleanup, RigFact rig = RigFact::safe) {
    if (cleanup != Cleanup::done || rig != RigFact::safe) return end(outcome, cleanup, rig);
    state_.campaign_outcome = outcome;
    state_.last_until = now_ + from_seconds(plan_.finally.budget_s);
    next_last_step();
  }

  /// Somebody may have a hand at the plate: nothing moves any more, and nothing is done finally.
  void end_at_rest(Outcome outcome) {
    const bool leaves_out = !steps_after(plan_.finally, outcome).empty();
    end(outcome, leaves_out ? Cleanup::partial : Cleanup::done);
  }

  void next_last_step() {
    const std::vector<LastStep>& steps = last_steps();
    if (state_.last_step == steps.size()) return end(*state_.campaign_outcome, Cleanup::done);
    const double left_s = to_seconds(state_.last_until - now_);
    if (left_s <= 0) return last_step_timed_out();
    const LastStep& next = steps[state_.last_step++];
    enter(Step::concluding, std::min(left_s, duration_s(plan_, next)));
    if (auto moves = moves_of(plan_, next); !moves.empty()) move(std::move(moves));
  }

  void last_step_timed_out() {
    if (now_ >= state_.last_until)
      return give_up_last(budget_used_up("finally", plan_.finally.budget_s), RigFact::safe);
    const LastStep& under_way = last_steps()[state_.last_step - 1];
    if (std::holds_alternative<WaitStep>(under_way)) return next_last_step();
    give_up_last(step_timed_out("finally"), RigFact::unknown);
  }

  /// The rest is left out. What the trials came to stays as it is.
  void give_up_last(std::optional<Error> error, RigFact rig) {
    if (error) note(*error);
    emit(StopMotion{});
    end(*state_.campaign_outcome, Cleanup::partial, rig);
  }

  void end(Outcome outcome, Cleanup cleanup, RigFact rig = RigFact::safe) {
    state_.step = Step::done;
    ++state_.ticket;
    emit(CampaignDone{outcome, cleanup, rig, state_.first_error});
  }

  // ---- helpers ----

  void emit(Effect effect) { effects_.push_back(std::move(effect)); }

  void move(std::vector<AxisMove> moves) { emit(MoveTo{state_.ticket, std::move(moves)}); }

  void enter(Step step, double timeout_s) {
    state_.step = step;
    ++state_.ticket;
    emit(ArmTimer{state_.ticket, now_ + from_seconds(timeout_s)});
  }

  void close_phase() {
    if (is_recording(state_.step)) emit(SetPhase{Phase::none});
  }

  [[nodiscard]] bool is_concluding() const { return state_.step == Step::concluding; }
  [[nodiscard]] const std::vector<LastStep>& last_steps() const {
    return steps_after(plan_.finally, *state_.campaign_outcome);
  }

  /// The probe is up, the stages are at rest, and no trial is open.
  [[nodiscard]] bool between_trials() const {
    return state_.step == Step::held || state_.step == Step::awaiting_operator;
  }

  [[nodiscard]] bool answers(Ticket ticket, Step step) const {
    return state_.step == step && ticket == state_.ticket;
  }

  void note(const Error& error) {
    if (!state_.first_error) state_.first_error = error;
  }

  [[nodiscard]] const TrialSpec& trial() const { return plan_.trials[state_.trial]; }
  [[nodiscard]] const Exploration& exploration() const {
    return plan_.explorations[trial().exploration];
  }

  [[nodiscard]] AxisMove lift() const {
    return {Axis::z, plan_.limits.clear_z_m(), plan_.approach.transfer_speed_mps};
  }

  [[nodiscard]] double travel_s(Axis axis) const {
    return full_travel_s(plan_.limits, axis, plan_.approach.transfer_speed_mps);
  }

  [[nodiscard]] std::string place() const {
    return "trial " + std::to_string(trial().index) + " (" + plan_.fabrics[trial().fabric] + ", " +
           exploration().name + ", repetition " + std::to_string(trial().repetition) +
           "): " + std::string(to_string(state_.step));
  }

  const Plan& plan_;
  State state_;
  TimePoint now_;
  std::vector<Effect> effects_;
};

}  // namespace

Transition step(const Plan& plan, const State& state, const Event& event, TimePoint now) {
  return Machine(plan, state, now).run(event);
}

}  // namespace weft::recipes
