#pragma once
// All that can be found out about a recipe and a rig before anything moves or is written.

#include "daemon/campaign/bench_check.hpp"
#include "daemon/campaign/campaign.hpp"

namespace weft::daemon {

/// A finding and the file that it is about.
struct FileProblem {
  std::filesystem::path file;
  recipes::Diagnostic what;
};

/// `plan` is there when the recipe by itself can be planned; the bench is looked at only then.
struct Preflight {
  std::string recipe_text;
  std::optional<recipes::Plan> plan;
  SimulationNote simulation;
  std::vector<FileProblem> problems;
  std::vector<recipes::Diagnostic> warnings;
};

/// Of what a request names as recipe, rig, seed, fidelity and plugins. Errors: what keeps the files
/// from being read at all.
Result<Preflight> preflight(const CampaignRequest& request,
                            PluginDrivers plugins = PluginDrivers::built);

/// The bench of a request as a plan finds it, its fidelity chosen; `rig`: its file, with drivers.
struct BenchPreflight {
  SimulationNote simulation;
  BenchProblems found_problems;
};
/// Errors: what keeps the settled rig file from being read.
Result<BenchPreflight> preflight_bench(const CampaignRequest& request, const recipes::Plan& plan,
                                       const RigFile& rig, PluginDrivers plugins);

}  // namespace weft::daemon
