#pragma once
// `--plugins` and `--plugins-only`, of the commands that make a rig's drivers.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/apps/weft/console.hpp"
#include "daemon/campaign/simulation.hpp"
#include "daemon/hardware/plugins/driver_catalog.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

// `--accuracy` and `--budget`, of the commands that simulate a campaign or look at one.

struct FidelityArgs {
  std::string accuracy, budget;  ///< as typed; empty: not asked for
};
/// A text that cannot be read is refused with the command line.
void add_options(CLI::App& command, FidelityArgs& args);

FidelityRequest fidelity_request(const FidelityArgs& args);

struct PluginArgs {
  std::vector<std::filesystem::path> folders;
  bool only = false;
};
void add_options(CLI::App& command, PluginArgs& args);

/// The folders of the command line, then those of WEFT_PLUGIN_PATH, separated by colons. A plugin
/// that hangs ends the process with exit_failure after the sentence (and the object of --json).
PluginSettings make_settings(const PluginArgs& args, const Console& console);

}  // namespace weft::daemon::cli
