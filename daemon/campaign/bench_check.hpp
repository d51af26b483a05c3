#pragma once
// What only shows when a bench is put together: drivers, emulators, the cloth table.

#include <filesystem>
#include <vector>

#include "daemon/campaign/open_rig.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon {

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

}  // namespace weft::daemon
