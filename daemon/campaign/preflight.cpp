#include "daemon/campaign/preflight.hpp"

#include "daemon/campaign/live_classifier.hpp"

namespace weft::daemon {
namespace {

using recipes::Diagnostic;

void add(const std::filesystem::path& file, const std::vector<Diagnostic>& list,
         std::vector<FileProblem>& problems) {
  for (const Diagnostic& diagnostic : list) problems.push_back({file, diagnostic});
}

}  // namespace

Result<BenchPreflight> preflight_bench(const CampaignRequest& request, const recipes::Plan& plan,
                                       const RigFile& rig, PluginDrivers plugins) {
  const auto chosen = choose_simulation(rig, request.rig, plan, request.fidelity);
  // A fidelity that is refused is told once; the rig file as it stands may have other problems.
  Result<RigFile> settled = parse_rig_file(chosen ? chosen->rig_text : rig.text);
  if (!settled) return pass(settled.error(), request.rig.string());
  settled->drivers = rig.drivers;
  BenchPreflight out{chosen ? chosen->note : SimulationNote{},
                     check_bench(plan, *settled, request.rig, plugins)};
  if (!chosen && out.found_problems.rig.empty())
    out.found_problems.rig.push_back(diagnostic(chosen.error(), pointer_in(chosen.error().where)));
  return out;
}

Result<Preflight> preflight(const CampaignRequest& request, PluginDrivers plugins) {
  const auto opened = open_rig(request.rig, request.plugins);
  if (!opened) return pass(opened.error());
  Result<std::string> text = load_recipe_text(request);
  if (!text) return pass(text.error());
  recipes::CheckReport checked = recipes::check_recipe(*text, opened->limits, request.seed);
  Preflight out{std::move(*text), std::move(checked.plan), {}, {}, std::move(checked.warnings)};
  add(request.recipe, checked.problems, out.problems);
  if (!out.plan) return out;
  if (const auto models = load_live_models(*out.plan, request.recipe.parent_path()); !models)
    add(request.recipe, {diagnostic(models.error(), pointer_in(models.error().where))},
        out.problems);
  auto bench = preflight_bench(request, *out.plan, opened->file, plugins);
  if (!bench) return pass(bench.error());
  out.simulation = std::move(bench->simulation);
  add(request.recipe, bench->found_problems.recipe, out.problems);
  add(request.rig, bench->found_problems.rig, out.problems);
  return out;
}

}  // namespace weft::daemon
