#pragma once
// All that can be found out about a recipe and a rig before anything moves or is written.

#include "daemon/cli/console.hpp"
#include "daemon/run/campaign.hpp"

namespace weft::daemon::cli {

/// A finding and the file that it is about.
struct FileProblem {
  std::filesystem::path file;
  recipes::Diagnostic what;
};

/// `plan` is there when the recipe by itself can be planned; the bench is looked at only then.
struct Preflight {
  std::optional<recipes::Plan> plan;
  SimulationNote simulation;
  std::vector<FileProblem> problems;
  std::vector<recipes::Diagnostic> warnings;
};

/// Errors: what keeps the files from being read at all.
Result<Preflight> preflight(const std::filesystem::path& recipe, const std::filesystem::path& rig,
                            std::optional<std::uint64_t> seed = {},
                            const FidelityAsked& fidelity = {}, const PluginSettings& plugins = {});

/// {"pointer", "message", "expected", "got", "hint", "sentence"}
nlohmann::json diagnostic_json(const recipes::Diagnostic& diagnostic);

/// Every problem under the name of its file; with --json also in the error object. Returns
/// exit_failure.
int refuse(const std::vector<FileProblem>& problems, Console& console);

}  // namespace weft::daemon::cli
