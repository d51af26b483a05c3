#include "recipes/engine/engine.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "recipes/engine/machine.hpp"

// The effect of each event in each step. machine_steps.cpp has the steps of a trial,
// machine_ends.cpp the ends of trials and campaigns.

namespace weft::recipes {

Transition step(const Plan& plan, const State& state, const Event& event, TimePoint now) {
  return Machine(plan, state, now).run(event);
}

Transition Machine::run(const Event& event) {
  if (state_.step != Step::done) std::visit([this](const auto& e) { on(e); }, event);
  return {std::move(state_), std::move(effects_)};
}

void Machine::on(const Start& start) {
  if (state_.step != Step::ready) return;
  if (start.first_trial >= plan_.trials.size()) return finish(Outcome::complete, Cleanup::skipped);
  state_.trial = state_.first_trial = start.first_trial;
  state_.rejected = start.rejected;
  begin_trial(true);
}

void Machine::on(const OperatorConfirmed& event) {
  if (!answers(event.ticket, Step::awaiting_operator)) return;
  ++state_.operator_step;
  begin_trial(true);
}

void Machine::on(const MotionDone& event) {
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
    case Step::pressing:
      if (by_depth()) record(Step::holding, Phase::press);
      return;
    case Step::sliding:
      return next_leg();
    case Step::lifting:
      if (force_n() == 0) return record(Step::holding, Phase::press);
      return fail_trial(force_not_reached(place(), force_n()));
    case Step::releasing:
      return fail_trial(force_not_reached(place(), plan_.limits.probe_weight_n));
    case Step::unloading:
      return record(Step::ending, Phase::end);
    case Step::retracting:
      return end_trial(Cleanup::done);
    case Step::concluding:
      return next_last_step();
    default:
      return;
  }
}

void Machine::on(const ForceReached& event) {
  if (answers(event.ticket, Step::approaching))
    return by_depth() ? lower_to_rest(event.z_m) : seat();
  if (answers(event.ticket, Step::seating)) return lower_to_rest(event.z_m);
  if (answers(event.ticket, Step::lifting) && force_n() > 0) return hold_force();
  if (answers(event.ticket, Step::releasing)) unload(event.z_m);
}

void Machine::on(const RestMeasured& event) {
  constexpr double sure_deviations = 3;
  constexpr double zero_n = 0.05;  // allowed error of the sensor's bias
  const double weight_n = plan_.limits.probe_weight_n;
  const double tolerance_n =
      std::max({plan_.limits.rest_tolerance * weight_n, sure_deviations * event.error_n, zero_n});
  if (!in_trial() || std::abs(event.mean_n - weight_n) <= tolerance_n) return;
  Error error = not_at_rest(place(), event.phase, event.mean_n, weight_n);
  if (state_.step != Step::retracting) return fail_trial(std::move(error));
  if (state_.trial_outcome) return;
  note(error);
  state_.trial_outcome = Outcome::failed;
  state_.trial_error = std::move(error);
}

void Machine::on(const TimerExpired& event) {
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
      note(step_timed_out(place()));
      return give_up_retreat();
    case Step::held:
    case Step::awaiting_operator:
      return end_at_rest(Outcome::stopped);
    case Step::concluding:
      return last_step_timed_out();
    default:
      return fail_trial(step_timed_out(place(), event.awaited));
  }
}

void Machine::on(const AttemptRejected& event) {
  if (plan_.repeat_bad && state_.step == Step::retracting) state_.bad_attempt = event.why;
}

void Machine::on(const EndSlide&) {
  if (state_.step != Step::sliding) return;
  const auto& vote = exploration().live_vote;
  if (!vote || !vote->stop_early) return;
  state_.ended_early = true;
  emit(StopMotion{});
  release();
}

void Machine::on(const Fault& event) {
  if (is_concluding()) return give_up_last(event.error, RigFact::unknown);
  note(event.error);
  state_.campaign_outcome = Outcome::failed;
  cut_short(Outcome::failed, event.error);
}

void Machine::on(const GuardTripped& event) {
  if (event.trip.action == GuardAction::hold) return;  // the scan cycle itself sends no command
  if (event.trip.action == GuardAction::finish_trial) {
    note(event.trip.error);
    return on(StopRequested{});
  }
  const bool grave = event.trip.action == GuardAction::end_campaign;
  if (is_concluding())
    return give_up_last(event.trip.error, grave ? RigFact::unknown : RigFact::safe);
  // A person working on the plate may load the sensor beyond its rating.
  if (between_trials() && (!grave || event.trip.guard == Guard::invalid_wrench)) return;
  if (grave) {
    note(event.trip.error);
    state_.campaign_outcome = Outcome::failed;
  }
  cut_short(Outcome::failed, event.trip.error);
}

void Machine::on(const PauseRequested& event) {
  if (state_.step == Step::ready || state_.step == Step::held || is_concluding()) return;
  if (state_.step == Step::awaiting_operator) return hold();
  state_.pause_requested = true;
  if (!event.at_once && state_.step > Step::mounting) return;
  if (state_.step == Step::retracting) return;
  state_.repeats = true;
  cut_short(Outcome::stopped, std::nullopt);
}

void Machine::on(const ResumeRequested&) {
  state_.pause_requested = false;
  if (state_.step == Step::held) begin_trial(true);
}

void Machine::on(const StopRequested&) {
  state_.stop_requested = true;
  if (between_trials()) return end_at_rest(Outcome::stopped);
  // Nothing has been touched yet: there is no trial to finish.
  if (state_.step <= Step::mounting) {
    state_.campaign_outcome = Outcome::stopped;
    cut_short(Outcome::stopped, std::nullopt);
  }
}

void Machine::on(const AbortRequested&) {
  if (is_concluding()) return give_up_last(std::nullopt, RigFact::safe);
  if (state_.campaign_outcome != Outcome::failed) state_.campaign_outcome = Outcome::aborted;
  cut_short(Outcome::aborted, std::nullopt);
}

void Machine::on(const HaltRequested&) {
  close_phase();
  emit(StopMotion{});
  if (in_trial())
    emit(TrialDone{state_.trial, Outcome::aborted, Cleanup::skipped, state_.trial_error});
  end(is_concluding() ? *state_.campaign_outcome : Outcome::aborted, Cleanup::skipped,
      RigFact::holding);
}

namespace {

template <std::size_t count>
std::string_view name_at(const std::array<std::string_view, count>& names, std::size_t value) {
  return value < count ? names[value] : "unknown";
}

}  // namespace

std::string_view to_string(Outcome outcome) {
  constexpr std::array<std::string_view, 6> names{"complete", "stopped",     "aborted",
                                                  "failed",   "interrupted", "rejected"};
  static_assert(names.size() == static_cast<std::size_t>(Outcome::rejected) + 1);
  return name_at(names, static_cast<std::size_t>(outcome));
}

std::string_view to_string(Cleanup cleanup) {
  constexpr std::array<std::string_view, 4> names{"done", "partial", "failed", "skipped"};
  static_assert(names.size() == static_cast<std::size_t>(Cleanup::skipped) + 1);
  return name_at(names, static_cast<std::size_t>(cleanup));
}

std::string_view to_string(RigFact rig) {
  constexpr std::array<std::string_view, 5> names{"safe", "holding", "moving", "unknown",
                                                  "latched"};
  static_assert(names.size() == static_cast<std::size_t>(RigFact::latched) + 1);
  return name_at(names, static_cast<std::size_t>(rig));
}

std::string_view to_string(Step step) {
  constexpr std::array<std::string_view, 21> names{
      "ready",     "clearing",    "awaiting_operator", "mounting", "positioning",
      "biasing",   "approaching", "seating",           "lowering", "resting",
      "lifting",   "pressing",    "holding",           "sliding",  "releasing",
      "unloading", "ending",      "retracting",        "held",     "concluding",
      "done"};
  static_assert(names.size() == static_cast<std::size_t>(Step::done) + 1);
  return name_at(names, static_cast<std::size_t>(step));
}

}  // namespace weft::recipes
