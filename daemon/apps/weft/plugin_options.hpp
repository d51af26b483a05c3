#pragma once
// `--plugins` and `--plugins-only`, of the commands that make a rig's drivers.

#include <filesystem>
#include <vector>

#include "daemon/apps/weft/console.hpp"
#include "daemon/hardware/plugins/driver_catalog.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct PluginArgs {
  std::vector<std::filesystem::path> folders;
  bool only = false;
};
void add_options(CLI::App& command, PluginArgs& args);

/// The folders of the command line, then those of WEFT_PLUGIN_PATH, separated by colons. A plugin
/// that hangs ends the process with exit_failure after the sentence (and the object of --json).
PluginSettings make_settings(const PluginArgs& args, const Console& console);

}  // namespace weft::daemon::cli
