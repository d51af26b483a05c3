#pragma once
// What only shows when a bench is put together: drivers, emulators, the cloth table.

#include <filesystem>
#include <vector>

#include "daemon/run/rig_file.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon::cli {

/// Findings with pointers into the rig file or into the recipe.
struct BenchFindings {
  std::vector<recipes::Diagnostic> rig;
  std::vector<recipes::Diagnostic> recipe;
};

/// An error of the bench as a finding at `pointer`.
recipes::Diagnostic diagnostic(const Error& error, std::string pointer);
/// The JSON pointer at the end of an error's place, which may have other places in front of it.
std::string pointer_in(const std::string& where);

/// Builds every driver and emulator of `rig` without moving them, compares the limits that the plan
/// was made for with what the stages' drivers allow, and puts a patch of every fabric of the plan
/// on the plate of the dry bench. All problems at once.
BenchFindings check_bench(const recipes::Plan& plan, const RigFile& rig,
                          const std::filesystem::path& rig_path);

}  // namespace weft::daemon::cli
