#pragma once
// `weft check`: a recipe against a rig, without moving anything.

#include <filesystem>

#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/fidelity_options.hpp"
#include "daemon/apps/weft/plugin_options.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct CheckArgs {
  std::filesystem::path recipe;
  std::filesystem::path rig;
  FidelityArgs fidelity;
  PluginArgs plugins;
};
void add_options(CLI::App& command, CheckArgs& args);

/// Prints plan, duration, bytes, envelope and margins. A refused recipe is not an error of this
/// function: all its problems are printed and exit_failure is returned.
Result<int> run_check(const CheckArgs& args, Console& console);

}  // namespace weft::daemon::cli
