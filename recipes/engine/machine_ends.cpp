// Ends of trials and of the campaign: early end, quality check, repeat, and final steps.

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "recipes/engine/engine.hpp"
#include "recipes/engine/machine.hpp"
#include "recipes/engine/motion.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::recipes {
namespace {

/// Outcome of the current trial. A finished trial with a bad record is repeated, or fails after the
/// last attempt. `place` names the trial in messages.
Outcome evaluated(const Plan& plan, State& state, const std::string& place) {
  const Outcome outcome = state.trial_outcome.value_or(Outcome::complete);
  std::optional<Error> bad = std::exchange(state.bad_attempt, {});
  if (outcome != Outcome::complete || !bad) return outcome;
  if (++state.rejected < most_attempts(plan)) {
    state.trial_error = std::move(bad);
    return Outcome::rejected;
  }
  state.trial_error = still_bad(place, state.rejected, *bad);
  if (!state.first_error) state.first_error = state.trial_error;
  return Outcome::failed;
}

/// Outcome of the campaign if it ends before a trial is repeated; nullopt if it continues.
std::optional<Outcome> end_before_repeat(const State& state) {
  if (state.campaign_outcome) return state.campaign_outcome;
  if (state.stop_requested) return Outcome::stopped;
  return std::nullopt;
}

/// Outcome of the campaign if it ends after this trial; nullopt if it continues.
std::optional<Outcome> campaign_end(const Plan& plan, const State& state, Outcome trial_outcome) {
  if (state.campaign_outcome) return state.campaign_outcome;
  const bool stops = plan.on_trial_failure == OnTrialFailure::stop;
  if (trial_outcome == Outcome::failed && stops) return Outcome::failed;
  if (state.trial + 1 == plan.trials.size())
    return state.failed == 0 ? Outcome::complete : Outcome::failed;
  if (state.stop_requested) return Outcome::stopped;
  return std::nullopt;
}

}  // namespace

void Machine::cut_short(Outcome outcome, std::optional<Error> error) {
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

void Machine::give_up_retreat() {
  emit(StopMotion{});
  state_.campaign_outcome = Outcome::failed;
  end_trial(Cleanup::failed);
}

void Machine::end_trial(Cleanup cleanup) {
  const Outcome outcome = evaluated(plan_, state_, place());
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

void Machine::next_trial() {
  ++state_.trial;
  state_.rejected = 0;
  state_.operator_step = 0;
}

void Machine::finish(Outcome outcome, Cleanup cleanup, RigFact rig) {
  if (cleanup != Cleanup::done || rig != RigFact::safe) return end(outcome, cleanup, rig);
  state_.campaign_outcome = outcome;
  state_.last_until = now_ + from_seconds(plan_.finally.budget_s);
  next_last_step();
}

void Machine::end_at_rest(Outcome outcome) {
  const bool leaves_out = !steps_after(plan_.finally, outcome).empty();
  end(outcome, leaves_out ? Cleanup::partial : Cleanup::done);
}

void Machine::next_last_step() {
  const std::vector<LastStep>& steps = last_steps();
  if (state_.last_step == steps.size()) return end(*state_.campaign_outcome, Cleanup::done);
  const double left_s = to_seconds(state_.last_until - now_);
  if (left_s <= 0) return last_step_timed_out();
  const LastStep& next = steps[state_.last_step++];
  enter(Step::concluding, std::min(left_s, duration_s(plan_, next)));
  if (auto moves = list_moves(plan_, next); !moves.empty()) move(std::move(moves));
}

void Machine::last_step_timed_out() {
  if (now_ >= state_.last_until)
    return give_up_last(budget_used_up("finally", plan_.finally.budget_s), RigFact::safe);
  const LastStep& under_way = last_steps()[state_.last_step - 1];
  if (std::holds_alternative<WaitStep>(under_way)) return next_last_step();
  give_up_last(step_timed_out("finally"), RigFact::unknown);
}

void Machine::give_up_last(std::optional<Error> error, RigFact rig) {
  if (error) note(*error);
  emit(StopMotion{});
  end(*state_.campaign_outcome, Cleanup::partial, rig);
}

void Machine::end(Outcome outcome, Cleanup cleanup, RigFact rig) {
  state_.step = Step::done;
  ++state_.ticket;
  emit(CampaignDone{outcome, cleanup, rig, state_.first_error});
}

}  // namespace weft::recipes
