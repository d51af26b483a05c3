#include "daemon/apps/weft/plugin_options.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

namespace weft::daemon::cli {
namespace {

// Past the streams, which the thread that hangs may hold.
void write_line(int descriptor, const std::string& line) {
  [[maybe_unused]] const auto written = ::write(descriptor, line.data(), line.size());
}

}  // namespace

void add_options(CLI::App& command, PluginArgs& args) {
  command.add_option("--plugins", args.folders,
                     "folder with drivers (weft-driver-NAME.so); may be given again");
  command.add_flag("--plugins-only", args.only,
                   "leave out the drivers that are built in: for a plugin of the same name");
}

PluginSettings make_settings(const PluginArgs& args, const Console& console) {
  PluginSettings settings;
  settings.folders = args.folders;
  settings.builtins = !args.only;
  const char* path = std::getenv("WEFT_PLUGIN_PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');)
    if (!folder.empty()) settings.folders.emplace_back(folder);
  settings.hung = [json = console.json](const Error& error) {
    write_line(STDERR_FILENO, "weft: " + to_string(error) + "\n");
    if (json) write_line(STDOUT_FILENO, nlohmann::json{{"error", error_json(error)}}.dump() + "\n");
    ::_exit(exit_failure);
  };
  return settings;
}

}  // namespace weft::daemon::cli
