#include <nlohmann/json.hpp>

#include "daemon/analysis/report/report.hpp"
#include "daemon/apps/weft/bench_options.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/console.hpp"
#include "daemon/base/text/format.hpp"
#include "protocols/base/time.hpp"
#include "recipes/engine/operator_steps.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;
using recipes::Diagnostic;
using recipes::Plan;

struct CheckArgs {
  std::filesystem::path recipe;
  std::filesystem::path rig;
  ParameterArgs parameters;
  FidelityArgs fidelity;
  PluginArgs plugins;
};

json to_json(const std::vector<Diagnostic>& list) {
  json out = json::array();
  for (const Diagnostic& d : list) out.push_back(diagnostic_json(d));
  return out;
}

json to_json(const recipes::Forecast& forecast) {
  const auto& force = forecast.force_n;
  return {{"duration_s", forecast.duration_s},
          {"people_s", forecast.people_s},
          {"asks", forecast.prompts},
          {"mounts", forecast.mounts},
          {"total_s", forecast.total_s()},
          {"bytes", forecast.bytes},
          {"envelope", envelope_json(forecast)},
          {"force_min_n", force ? json(force->min) : json()},
          {"force_max_n", force ? json(force->max) : json()}};
}

constexpr std::size_t max_listed_prompts = 100;

/// The first operator prompts, each with the machine time until then.
template <class Callback>
void for_first_prompts(const Plan& plan, std::size_t most, const Callback& callback) {
  for (std::size_t trial = 0; most > 0; ++trial) {
    const auto next = recipes::next_prompt(plan, trial);
    if (!next) return;
    trial = next->trial;
    for (auto step = recipes::due_step(plan, trial, 0, false); step && most > 0;
         step = recipes::due_step(plan, trial, *step + 1, false), --most)
      callback(recipes::step_prompt(plan, trial, *step), recipes::machine_s(plan, 0, trial));
  }
}

json prompts_json(const Plan& plan) {
  json out = json::array();
  for_first_prompts(plan, max_listed_prompts,
                    [&](const recipes::StepPrompt& prompt, double after_s) {
                      out.push_back({{"trial", prompt.trial},
                                     {"text", prompt.text},
                                     {"people_s", prompt.people_s},
                                     {"after_s", after_s}});
                    });
  return out;
}

std::string format_prompts(const Plan& plan) {
  constexpr std::size_t enough = 5;
  if (plan.forecast.prompts == 0) return {};
  std::string out = "Operator steps:\n";
  for_first_prompts(plan, enough, [&](const recipes::StepPrompt& prompt, double after_s) {
    out += "  after " + duration(after_s) + " of machine time: " + prompt.text + " (" +
           duration(prompt.people_s) + ")\n";
  });
  if (plan.forecast.prompts > enough)
    out += "  and " + std::to_string(plan.forecast.prompts - enough) + " more\n";
  return out;
}

json sweep_json(const Plan& plan) {
  if (!plan.sweep) return nullptr;
  const recipes::Sweep& sweep = *plan.sweep;
  json factors = json::array();
  for (const recipes::Factor& factor : sweep.factors)
    factors.push_back({{"name", recipes::factor_name(factor.kind)}, {"values", factor.values}});
  return {{"factors", factors},
          {"cells", sweep.cells.size()},
          {"full_cells", sweep.full_cells()},
          {"d_efficiency", sweep.d_efficiency},
          {"replicates", sweep.replicates},
          {"block_by", recipes::to_string(sweep.block_by)},
          {"explorations", sweep.explorations}};
}

json plan_json(const CheckArgs& args, const Preflight& found) {
  const Plan& plan = *found.plan;
  json explorations = json::array();
  for (const recipes::Exploration& e : plan.explorations) explorations.push_back(e.name);
  return {{"command", "check"},
          {"recipe", args.recipe.string()},
          {"name", plan.name},
          {"rig", plan.limits.name},
          {"bench", plan.limits.bench},
          {"seed", plan.seed},
          {"parameters", json::parse(found.parameters_json)},
          {"trials", plan.trials.size()},
          {"fabrics", plan.fabrics},
          {"explorations", explorations},
          {"sweep", sweep_json(plan)},
          {"simulation", json::parse(to_json(found.simulation))},
          {"forecast", to_json(plan.forecast)},
          {"operator_steps", prompts_json(plan)},
          {"warnings", to_json(found.warnings)}};
}

std::string envelope_text(const recipes::Forecast& forecast) {
  Table table;
  table.row({"axis", "from", "to", "margin", ""});
  for (const recipes::Axis axis : recipes::all_axes) {
    if (forecast.fixed[recipes::index(axis)]) continue;
    const std::size_t k = recipes::index(axis);
    const bool linear = recipes::is_linear(axis);
    const double scale = linear ? 1.0 / m_per_mm : 1.0 / rad_per_deg;
    table.row({std::string(recipes::to_string(axis)), fixed(scale * forecast.envelope[k].min, 2),
               fixed(scale * forecast.envelope[k].max, 2), fixed(scale * forecast.margin[k], 2),
               linear ? "mm" : "deg"});
  }
  return table.text();
}

std::string plan_text(const Plan& plan, const SimulationNote& simulation,
                      const std::vector<Diagnostic>& warnings) {
  std::vector<std::string> names;
  for (const recipes::Exploration& e : plan.explorations) names.push_back(e.name);
  if (plan.sweep) names = plan.sweep->explorations;
  const recipes::Forecast& f = plan.forecast;
  Table facts(Align::left);
  facts.row({"recipe", plan.name});
  facts.row({"rig", plan.limits.name + " (" + plan.limits.bench + ")"});
  facts.row({"trials", thousands(plan.trials.size()) + ": " + std::to_string(plan.fabrics.size()) +
                           " fabrics, explorations " + joined(names)});
  if (plan.sweep) facts.row({"sweep", recipes::sweep_text(*plan.sweep)});
  facts.row(
      {"fabrics", "mounted " + std::to_string(f.mounts) + (f.mounts == 1 ? " time" : " times")});
  facts.row({"duration",
             duration(f.total_s()) +
                 (f.prompts == 0 ? ""
                                 : ": machine " + duration(f.duration_s) + ", operator " +
                                       duration(f.people_s) + " in " + std::to_string(f.prompts) +
                                       (f.prompts == 1 ? " step" : " steps"))});
  facts.row({"samples", fixed(static_cast<double>(f.bytes) / 1e6, 1) + " MB before compression"});
  if (f.force_n)
    facts.row({"force", fixed(f.force_n->min, 2) + " to " + fixed(f.force_n->max, 2) + " N"});
  else
    facts.row({"force", "not measured: the rig has no force sensor"});
  std::string out = "The rig can run this recipe.\n" + facts.text() + simulation_text(simulation) +
                    format_prompts(plan) + "Stage positions used:\n" + envelope_text(f);
  for (const Diagnostic& warning : warnings)
    out += "warning: " + recipes::to_string(warning) + "\n";
  return out;
}

void add_options(CLI::App& command, CheckArgs& args) {
  command.add_option("RECIPE", args.recipe, "recipe file (JSON)")->required();
  command.add_option("--rig", args.rig, "use this rig file (JSON)")->required();
  add_options(command, args.parameters);
  add_options(command, args.fidelity);
  add_options(command, args.plugins);
}

/// Prints plan, duration, bytes, envelope and margins. A refused recipe is no error of this
/// function: it prints all its problems and returns exit_failure.
Result<int> run_check(const CheckArgs& args, Console& console) {
  CampaignRequest request{args.recipe, args.rig, {}, {}, fidelity_request(args.fidelity)};
  request.plugins = make_settings(args.plugins, console);
  request.parameters_json = parameters_json(args.parameters);
  const Result<Preflight> found = preflight(request);
  if (!found) return pass(found.error());
  if (!found->problems.empty()) return refuse(found->problems, console);
  print(console, plan_text(*found->plan, found->simulation, found->warnings),
        plan_json(args, *found));
  return exit_ok;
}

}  // namespace

void add_check_command(const CommandGroup& weft) {
  weft.add<CheckArgs>("check", run_check);
}

}  // namespace weft::daemon::cli
