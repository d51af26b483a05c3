#pragma once
// What people do between trials: when it is due, what they are asked, and how long it takes.

#include <cstddef>
#include <optional>
#include <string>

#include "recipes/engine/plan.hpp"

namespace weft::recipes {

/// Asked of a person before a trial.
struct StepPrompt {
  std::size_t trial = 0;  ///< into Plan::trials
  std::size_t step = 0;   ///< into Plan::operator_steps
  std::string text;       ///< for people, the fabric in its place
  double people_s = 0;    ///< how long people usually take [s]
};

/// The first of the plan's steps, from `from` on, that is due before a trial. `begins`: the
/// campaign begins or goes on with this trial, and nobody knows what lies on the plate.
std::optional<std::size_t> due_step(const Plan& plan, std::size_t trial, std::size_t from,
                                    bool begins);

/// Whether some step is due whenever this fabric comes, or is put on.
bool has_prompt_before(const Plan& plan, std::size_t fabric, OperatorStep::Before before);

StepPrompt step_prompt(const Plan& plan, std::size_t trial, std::size_t step);

/// The first ask before a trial from `from` on, where the campaign began with the first one;
/// nothing when people are needed no more.
std::optional<StepPrompt> next_prompt(const Plan& plan, std::size_t from);

/// Machine time between the begin of two trials, by the mean of the forecast [s].
double machine_s(const Plan& plan, std::size_t from, std::size_t to);

struct PeopleForecast {
  std::size_t prompts = 0;
  double people_s = 0;
};
/// Of all asks before trials from `from` on, where the campaign began with the first one.
PeopleForecast people_forecast(const Plan& plan, std::size_t from = 0);

}  // namespace weft::recipes
