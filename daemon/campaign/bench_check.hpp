#pragma once
// What only shows when a bench is put together: drivers, emulators, the cloth table.

#include <filesystem>
#include <vector>

#include "daemon/campaign/campaign.hpp"
#include "daemon/hardware/rig/rig_file.hpp"
#include "recipes/engine/plan.hpp"
#include "recipes/engine/rig_limits.hpp"

namespace weft::daemon {

// A rig file with what is read from it, as every command begins that works on a rig.

struct OpenedRig {
  RigFile file;               ///< its drivers also from plugins
  recipes::RigLimits limits;  ///< that the file sets
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
/// The JSON pointer at the end of an error's place, which may have other places in front of it.
std::string pointer_in(const std::string& where);

/// Whether drivers of plugins are built as well. One that hangs ends the process, which may have a
/// run under way; unread, of them no more than the name is looked at.
enum class PluginDrivers { built, unread };

/// Builds every driver and emulator of `rig` without moving them, compares the limits that the plan
/// was made for with what the stages' drivers allow, and puts a patch of every fabric of the plan
/// on the plate of the dry bench. All problems at once.
BenchProblems check_bench(const recipes::Plan& plan, const RigFile& rig,
                          const std::filesystem::path& rig_path,
                          PluginDrivers plugins = PluginDrivers::built);
/// What of that needs no plan.
std::vector<recipes::Diagnostic> check_rig(const OpenedRig& rig,
                                           const std::filesystem::path& rig_path,
                                           PluginDrivers plugins);
/// Both of a file as it is now, plugins' drivers unread. Errors: open_rig()'s; invalid_argument,
/// the first problem.
Status check_rig_file(const std::filesystem::path& path);

// All that can be found out about a recipe and a rig before anything moves or is written.

/// A finding and the file that it is about.
struct FileProblem {
  std::filesystem::path file;
  recipes::Diagnostic what;
};

/// `plan` is there when the recipe by itself can be planned; the bench is looked at only then.
struct Preflight {
  std::string recipe_text;  ///< resolved, where nothing was wrong with it
  std::optional<recipes::Plan> plan;
  SimulationNote simulation;
  std::vector<FileProblem> problems;
  std::vector<recipes::Diagnostic> warnings;
  std::string file_text;        ///< of the recipe, as it was read
  std::string parameters_json;  ///< as the recipe declares them
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
