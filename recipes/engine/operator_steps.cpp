#include "recipes/engine/operator_steps.hpp"

#include <algorithm>

namespace weft::recipes {
namespace {

bool is_for(const OperatorStep& step, std::size_t fabric) {
  return step.fabrics.empty() ||
         std::find(step.fabrics.begin(), step.fabrics.end(), fabric) != step.fabrics.end();
}

bool is_due(const Plan& plan, const OperatorStep& step, std::size_t trial, bool begins) {
  if (step.before == OperatorStep::Before::campaign) return begins;
  const std::size_t fabric = plan.trials[trial].fabric;
  if (!is_for(step, fabric)) return false;
  if (begins || plan.trials[trial - 1].fabric != fabric) return true;
  return step.before == OperatorStep::Before::mounting &&
         plan.trials[trial - 1].place.mounting != plan.trials[trial].place.mounting;
}

void replace_all(std::string& text, std::string_view mark, const std::string& with) {
  for (std::size_t at = text.find(mark); at != std::string::npos;
       at = text.find(mark, at + with.size()))
    text.replace(at, mark.size(), with);
}

}  // namespace

std::optional<std::size_t> due_step(const Plan& plan, std::size_t trial, std::size_t from,
                                    bool begins) {
  for (std::size_t i = from; i < plan.operator_steps.size(); ++i)
    if (is_due(plan, plan.operator_steps[i], trial, begins || trial == 0)) return i;
  return std::nullopt;
}

bool has_prompt_before(const Plan& plan, std::size_t fabric, OperatorStep::Before before) {
  return std::ranges::any_of(plan.operator_steps, [&](const OperatorStep& step) {
    const bool asks = step.before == before || step.before == OperatorStep::Before::mounting;
    return asks && is_for(step, fabric);
  });
}

StepPrompt step_prompt(const Plan& plan, std::size_t trial, std::size_t step) {
  const OperatorStep& requested = plan.operator_steps[step];
  const std::size_t fabric = plan.trials[trial].fabric;
  StepPrompt out{trial, step, requested.text, requested.people_s};
  replace_all(out.text, fabric_mark, plan.fabrics[fabric]);
  replace_all(out.text, number_mark, std::to_string(fabric + 1));
  replace_all(out.text, piece_mark, std::to_string(plan.trials[trial].place.piece));
  replace_all(out.text, mounting_mark, std::to_string(plan.trials[trial].place.mounting));
  return out;
}

std::optional<StepPrompt> next_prompt(const Plan& plan, std::size_t from) {
  if (plan.operator_steps.empty()) return std::nullopt;
  for (std::size_t trial = from; trial < plan.trials.size(); ++trial)
    if (const auto step = due_step(plan, trial, 0, false)) return step_prompt(plan, trial, *step);
  return std::nullopt;
}

double machine_s(const Plan& plan, std::size_t from, std::size_t to) {
  return plan.forecast.trials_s() * (static_cast<double>(to) - static_cast<double>(from)) /
         static_cast<double>(plan.trials.size());
}

PeopleForecast people_forecast(const Plan& plan, std::size_t from) {
  PeopleForecast out;
  if (plan.operator_steps.empty()) return out;
  for (std::size_t trial = from; trial < plan.trials.size(); ++trial)
    for (auto step = due_step(plan, trial, 0, false); step;
         step = due_step(plan, trial, *step + 1, false)) {
      ++out.prompts;
      out.people_s += plan.operator_steps[*step].people_s;
    }
  return out;
}

}  // namespace weft::recipes
