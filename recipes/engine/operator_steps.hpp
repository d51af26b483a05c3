#pragma once
// Operator steps between trials: when they are due, their prompts, and their duration.

#include <cstddef>
#include <optional>
#include <string>

#include "recipes/engine/plan.hpp"

namespace weft::recipes {

/// Prompt to the operator before a trial.
struct StepPrompt {
  std::size_t trial = 0;  ///< index into Plan::trials
  std::size_t step = 0;   ///< index into Plan::operator_steps
  std::string text;       ///< for people, with the name of the fabric inserted
  double people_s = 0;    ///< usual duration [s]
};

/// The first of the plan's steps, from `from` on, that is due before a trial. `begins`: the
/// campaign begins or resumes with this trial, so the fabric on the plate is not known.
std::optional<std::size_t> due_step(const Plan& plan, std::size_t trial, std::size_t from,
                                    bool begins);

/// Whether a step with this `before`, or one before each mounting, applies to the fabric.
bool has_prompt_before(const Plan& plan, std::size_t fabric, OperatorStep::Before before);

StepPrompt step_prompt(const Plan& plan, std::size_t trial, std::size_t step);

/// The first prompt before a trial from `from` on, for a campaign that began with the first one;
/// nullopt if no operator is needed any longer.
std::optional<StepPrompt> next_prompt(const Plan& plan, std::size_t from);

/// Machine time between the starts of two trials, as the mean of the forecast [s].
double machine_s(const Plan& plan, std::size_t from, std::size_t to);

struct PeopleForecast {
  std::size_t prompts = 0;
  double people_s = 0;
};
/// Forecast for all prompts before trials from `from` on, for a campaign that began with the first
/// one.
PeopleForecast people_forecast(const Plan& plan, std::size_t from = 0);

}  // namespace weft::recipes
