#pragma once
// The campaign's machine behind step(): one call collects the next state and the effects. Only
// engine.cpp and the two machine_*.cpp files beside it include this header.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "recipes/engine/engine.hpp"
#include "recipes/engine/motion.hpp"

namespace weft::recipes {

/// One call of step().
class Machine {
 public:
  Machine(const Plan& plan, const State& state, TimePoint now)
      : plan_(plan), state_(state), now_(now) {}

  Transition run(const Event& event);

 private:
  // ---- events; engine.cpp ----

  void on(const Start& start);
  void on(const OperatorConfirmed& event);
  void on(const Mounted& event) {
    if (answers(event.ticket, Step::mounting)) position();
  }
  void on(const Biased& event) {
    if (answers(event.ticket, Step::biasing)) approach();
  }
  void on(const MotionDone& event);
  /// Only a retract still waits for its motion: the fault has ended any other step.
  void on(const MotionLost& event) {
    if (answers(event.ticket, Step::retracting)) give_up_retreat();
  }
  void on(const ForceReached& event);
  /// E is checked during the retract, which it does not interrupt.
  void on(const RestMeasured& event);
  void on(const ForceSettled& event) {
    if (answers(event.ticket, Step::pressing)) record(Step::holding, Phase::press);
  }
  /// The timer ends a recorded phase; in any other step it means failure.
  void on(const TimerExpired& event);
  void on(const AttemptRejected& event);
  // The axes come to rest while z moves up, as in a trial that ends early.
  void on(const EndSlide&);
  void on(const Fault& event);
  void on(const GuardTripped& event);
  void on(const PauseRequested& event);
  void on(const ResumeRequested&);
  void on(const StopRequested&);
  void on(const AbortRequested&);
  void on(const HaltRequested&);

  // ---- steps of a trial, in order; machine_steps.cpp ----

  /// Operator steps come first; `up_first` if the stages may have been touched.
  void begin_trial(bool up_first);
  void prompt_operator(std::size_t operator_step);
  void clear();
  void mount();
  void position();
  void bias();
  void approach();
  void seat();
  void lower_to_rest(double touch_z_m);
  void press();
  void hover();
  void lighten();
  void press_by_depth();
  void hold_force();
  void slide();
  void next_leg();
  void start_leg();
  void release();
  void unload(double slack_end_z_m);
  void rest_again();
  void retract();
  /// Starts a recorded phase, which ends by its timer.
  void record(Step step, Phase phase);
  void descend(Step step, double speed_mps, double stop_force_n);
  void ascend(Step step, double speed_mps, double stop_force_n, double way_m);
  /// With this set point the probe hangs on its stop, at the lower end of the slack.
  [[nodiscard]] bool hangs(double force_n) const;
  /// Without a force sensor z presses by position.
  [[nodiscard]] bool by_depth() const { return !plan_.limits.has_wrench; }
  [[nodiscard]] double force_n() const { return exploration().step(Phase::press).force_n; }

  // ---- ends; machine_ends.cpp ----

  void fail_trial(Error error) { cut_short(Outcome::failed, std::move(error)); }
  /// Ends the current trial with a retract. A retract that is in progress continues.
  void cut_short(Outcome outcome, std::optional<Error> error);
  /// The probe is not known to be up: nothing follows. The caller has recorded the reason.
  void give_up_retreat();
  void end_trial(Cleanup cleanup);
  void hold() { enter(Step::held, to_seconds(longest_hold)); }
  void next_trial();
  /// Ends the campaign except for the final steps, which run if the probe is up.
  void finish(Outcome outcome, Cleanup cleanup, RigFact rig = RigFact::safe);
  /// A person may have a hand at the plate: nothing moves, and the final steps are skipped.
  void end_at_rest(Outcome outcome);
  void next_last_step();
  void last_step_timed_out();
  /// Skips the remaining final steps. The outcome of the trials does not change.
  void give_up_last(std::optional<Error> error, RigFact rig);
  void end(Outcome outcome, Cleanup cleanup, RigFact rig = RigFact::safe);

  // ---- helpers; machine_steps.cpp ----

  void emit(Effect effect) { effects_.push_back(std::move(effect)); }
  void move(std::vector<AxisMove> moves) { emit(MoveTo{state_.ticket, std::move(moves)}); }
  void enter(Step step, double timeout_s) {
    state_.step = step;
    ++state_.ticket;
    emit(ArmTimer{state_.ticket, now_ + from_seconds(timeout_s)});
  }
  void close_phase();
  [[nodiscard]] bool is_concluding() const { return state_.step == Step::concluding; }
  [[nodiscard]] const std::vector<LastStep>& last_steps() const {
    return steps_after(plan_.finally, *state_.campaign_outcome);
  }
  /// The probe is up, the stages are at rest, and no trial is open.
  [[nodiscard]] bool between_trials() const {
    return state_.step == Step::held || state_.step == Step::awaiting_operator;
  }
  [[nodiscard]] bool in_trial() const {
    return state_.step != Step::ready && !between_trials() && !is_concluding();
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
  [[nodiscard]] double move_s(double distance_m, double speed_mps) const {
    return move_duration_s(distance_m, speed_mps, plan_.limits.max_acceleration_mps2);
  }
  /// The current trial and step, for messages.
  [[nodiscard]] std::string place() const;

  const Plan& plan_;
  State state_;
  TimePoint now_;
  std::vector<Effect> effects_;
};

}  // namespace weft::recipes
