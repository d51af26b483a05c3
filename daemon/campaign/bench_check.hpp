#pragma once
// Finds problems that appear only in an assembled bench: drivers, emulators, the fabric table.

#include <filesystem>
#include <vector>

#include "daemon/campaign/campaign.hpp"
#include "daemon/hardware/rig/rig_file.hpp"
#include "recipes/engine/plan.hpp"
#include "recipes/engine/rig_limits.hpp"

namespace weft::daemon {

// A rig file and its parsed limits: the first step of every command that works on a rig.

struct OpenedRig {
  RigFile file;               ///< with the drivers of plugins
  recipes::RigLimits limits;  ///< set by the file
};

/// Errors: those of read_text_file(), recipes::parse_rig_limits() and parse_rig_file(), with the
/// file's name.
Result<OpenedRig> open_rig(const std::filesystem::path& path, const PluginSettings& plugins);

/// Findings with pointers into the rig file or into the recipe.
struct BenchProblems {
  std::vector<recipes::Diagnostic> rig;
  std::vector<recipes::Diagnostic> recipe;
};

/// An error of the bench as a finding at `pointer`.
recipes::Diagnostic diagnostic(const Error& error, std::string pointer);
/// The JSON pointer at the end of an error's place. Other places may precede it.
std::string pointer_in(const std::string& where);

/// Whether drivers of plugins are built as well. One that hangs ends the process, which may have a
/// run in progress. With `unread` only their names are checked.
enum class PluginDrivers { built, unread };

/// Builds every driver and emulator of `rig` without moving them. Compares the limits of the plan
/// with those of the stages' drivers. Puts a patch of every fabric of the plan on the plate of the
/// dry bench. Reports all problems at once.
BenchProblems check_bench(const recipes::Plan& plan, const RigFile& rig,
                          const std::filesystem::path& rig_path,
                          PluginDrivers plugins = PluginDrivers::built);
/// The part of check_bench() that needs no plan.
std::vector<recipes::Diagnostic> check_rig(const OpenedRig& rig,
                                           const std::filesystem::path& rig_path,
                                           PluginDrivers plugins);
/// open_rig() and check_rig() of the present file; drivers of plugins are not built. Errors:
/// open_rig()'s; invalid_argument with the first problem.
Status check_rig_file(const std::filesystem::path& path);

// All checks of a recipe and a rig that are possible before anything moves or is written.

/// A finding and its file.
struct FileProblem {
  std::filesystem::path file;
  recipes::Diagnostic what;
};

/// `plan` is present if the recipe alone can be planned; only then the bench is checked.
struct Preflight {
  std::string recipe_text;  ///< resolved, if it has no problem
  std::optional<recipes::Plan> plan;
  SimulationNote simulation;
  std::vector<FileProblem> problems;
  std::vector<recipes::Diagnostic> warnings;
  std::string file_text;        ///< the recipe as it was read
  std::string parameters_json;  ///< as declared by the recipe
};

/// Checks the recipe, rig, seed, fidelity and plugins of a request. Errors: the files cannot be
/// read at all.
Result<Preflight> preflight(const CampaignRequest& request,
                            PluginDrivers plugins = PluginDrivers::built);

/// The bench of a request, checked against a plan, with its fidelity chosen. `rig`: the parsed rig
/// file with its drivers.
struct BenchPreflight {
  SimulationNote simulation;
  BenchProblems found_problems;
};
/// Errors: the rig file with the chosen fidelity cannot be parsed.
Result<BenchPreflight> preflight_bench(const CampaignRequest& request, const recipes::Plan& plan,
                                       const RigFile& rig, PluginDrivers plugins);

}  // namespace weft::daemon
