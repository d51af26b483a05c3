#include "recipes/engine/trial_end.hpp"

#include <utility>

#include "recipes/engine/motion.hpp"

namespace weft::recipes {

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

std::optional<Outcome> end_before_repeat(const State& state) {
  if (state.campaign_outcome) return state.campaign_outcome;
  if (state.stop_requested) return Outcome::stopped;
  return std::nullopt;
}

std::optional<Outcome> campaign_end(const Plan& plan, const State& state, Outcome trial_outcome) {
  if (state.campaign_outcome) return state.campaign_outcome;
  const bool stops = plan.on_trial_failure == OnTrialFailure::stop;
  if (trial_outcome == Outcome::failed && stops) return Outcome::failed;
  if (state.trial + 1 == plan.trials.size())
    return state.failed == 0 ? Outcome::complete : Outcome::failed;
  if (state.stop_requested) return Outcome::stopped;
  return std::nullopt;
}

}  // namespace weft::recipes
