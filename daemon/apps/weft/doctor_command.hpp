#pragma once
// `weft doctor`: the devices of a rig, its ports and the machine, and what to do about each.

#include <filesystem>

#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/plugin_options.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct DoctorArgs {
  std::filesystem::path rig;
  std::filesystem::path out = ".";
  double listen_s = 2;
  PluginArgs plugins;
};
void add_options(CLI::App& command, DoctorArgs& args);

/// exit_failure when there is a problem; warnings alone do not count.
Result<int> run_doctor(const DoctorArgs& args, Console& console);

}  // namespace weft::daemon::cli
