#include <nlohmann/json.hpp>
#include <utility>

#include "recipes/engine/canonical.hpp"
#include "recipes/engine/forecast.hpp"
#include "recipes/engine/last_steps.hpp"
#include "recipes/engine/layout.hpp"
#include "recipes/engine/operator_steps.hpp"
#include "recipes/engine/plan.hpp"
#include "recipes/engine/recipe_reader.hpp"
#include "recipes/engine/sweep_cells.hpp"
#include "recipes/engine/sweep_warnings.hpp"
#include "recipes/engine/trial_order.hpp"
#include "recipes/schema/json_text.hpp"

namespace weft::recipes {
namespace {

void check_trial_count(const StatedRecipe& stated, Problems& problems) {
  const std::uint64_t trials =
      std::uint64_t{stated.fabrics.size()} * stated.explorations.size() * stated.repetitions;
  if (trials > max_trials)
    problems.add({"", "the campaign has too many trials", "at most " + std::to_string(max_trials),
                  std::to_string(trials), "lower \"repetitions\""});
}

/// On a real bench a person puts the cloth on the plate: that is asked for each fabric that the
/// recipe's own steps say nothing of. Returns whether there was one.
bool add_mount_steps(Plan& plan) {
  OperatorStep mount{OperatorStep::Before::fabric, {}, "Mount {fabric}, then confirm.", 60};
  for (std::size_t fabric = 0; fabric < plan.fabrics.size(); ++fabric)
    if (!has_prompt_before(plan, fabric)) mount.fabrics.push_back(fabric);
  if (mount.fabrics.empty()) return false;
  plan.operator_steps.push_back(std::move(mount));
  return true;
}

/// Free of problems by now, so everything is there.
Plan make_plan(StatedRecipe stated, const RigLimits& limits, std::string canonical) {
  Plan plan;
  plan.canonical_json = std::move(canonical);
  plan.trials = ordered_trials(stated);
  plan.name = std::move(stated.name);
  plan.seed = stated.seed;
  plan.fabrics = std::move(stated.fabrics);
  plan.class_of = std::move(stated.class_of);
  for (StatedExploration& exploration : stated.explorations)
    plan.explorations.push_back(std::move(exploration.exploration));
  plan.approach = stated.approach;
  plan.settle = stated.settle;
  plan.on_trial_failure = stated.on_trial_failure;
  plan.repeat_bad = stated.repeat_bad;
  plan.operator_steps = std::move(stated.operator_steps);
  plan.finally = std::move(stated.finally);
  plan.handover = std::move(stated.handover);
  plan.sweep = std::move(stated.sweep);
  plan.mount_timeout_s = stated.mount_timeout_s;
  plan.limits = limits;
  for (Exploration& exploration : plan.explorations)
    for (PhaseStep& phase : exploration.phases)
      if (phase.phase == Phase::motion)
        phase.duration_s = motion_duration_s(exploration, limits.max_acceleration_mps2);
  return plan;
}

std::vector<Diagnostic> warnings_about(const Plan& plan) {
  std::vector<Diagnostic> warnings;
  const double cycles = plan.limits.cycle_hz * plan.settle.dwell_s;
  if (cycles < 5)
    warnings.push_back({"/settle/dwell_s", "the force is judged settled after very few cycles",
                        "at least 5 cycles", std::to_string(cycles), "lengthen dwell_s"});
  if (plan.limits.fabrics.empty())
    warnings.push_back(
        {"/fabrics", "the rig names no fabrics, so these names were not checked", "", "", ""});
  const std::size_t once = plan.fabrics.size() * plan.operator_steps.size();
  if (plan.forecast.prompts > once)
    warnings.push_back({"/operator_steps", "fabrics are changed more often than once",
                        std::to_string(once) + " times",
                        std::to_string(plan.forecast.prompts) + " times",
                        "a blocked order asks once for each fabric"});
  for (const auto& more : {warnings_about_budget(plan.finally), warnings_about_sweep(plan)})
    warnings.insert(warnings.end(), more.begin(), more.end());
  return warnings;
}

}  // namespace

CheckReport check_recipe(std::string_view recipe_json, const RigLimits& limits,
                         std::optional<std::uint64_t> seed) {
  Problems problems;
  nlohmann::json document;
  if (!parse_json(recipe_json, {.max_bytes = max_recipe_bytes}, document, problems))
    return {std::nullopt, problems.take(), {}};
  StatedRecipe stated = read_recipe(document, limits, seed, problems);
  check_trial_count(stated, problems);
  for (StatedExploration& exploration : stated.explorations)
    place_on_plate(exploration, limits, problems);
  if (!problems.empty()) return {std::nullopt, problems.take(), {}};
  std::string canonical = canonical_json(stated);
  spread_sweep(stated, limits, problems);
  if (!problems.empty()) return {std::nullopt, problems.take(), {}};
  Plan plan = make_plan(std::move(stated), limits, std::move(canonical));
  const bool adds_mounts = limits.bench == "real" && add_mount_steps(plan);
  plan.forecast = forecast(plan);
  std::vector<Diagnostic> warnings = warnings_about(plan);
  if (adds_mounts)
    warnings.push_back({"/operator_steps",
                        "somebody must mount the fabrics on a real bench, and the recipe asks "
                        "nobody for some: each of these is asked for before its first trial",
                        "a step \"before\": \"fabric\"", "", ""});
  return {std::move(plan), {}, std::move(warnings)};
}

}  // namespace weft::recipes
