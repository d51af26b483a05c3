#pragma once
// What the end of a trial means: for the trial, and for the campaign.

#include <optional>
#include <string>

#include "recipes/engine/engine.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::recipes {

/// How the trial under way has ended. One that came to its end with a bad record is taken again, or
/// has failed at last; `place` says where, for people.
Outcome evaluated(const Plan& plan, State& state, const std::string& place);

/// How the campaign ends before a trial is run again, or nothing when it goes on.
std::optional<Outcome> end_before_repeat(const State& state);

/// How the campaign ends after a trial with this outcome, or nothing when it goes on.
std::optional<Outcome> campaign_end(const Plan& plan, const State& state, Outcome trial_outcome);

}  // namespace weft::recipes
