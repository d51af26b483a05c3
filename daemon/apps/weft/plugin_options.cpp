#include "daemon/apps/weft/plugin_options.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "sim/plant/fidelity/table.hpp"

namespace weft::daemon::cli {
namespace {

// Past the streams, which the thread that hangs may hold.
void write_line(int descriptor, const std::string& line) {
  [[maybe_unused]] const auto written = ::write(descriptor, line.data(), line.size());
}

template <class Parse>
auto problem_of(Parse parse) {
  return [parse](const std::string& text) {
    const Result<double> read = parse(text);
    return read ? std::string() : to_string(read.error());
  };
}

template <class Parse>
std::optional<double> read(const std::string& text, Parse parse) {
  if (text.empty()) return std::nullopt;
  const Result<double> value = parse(text);
  return value ? std::optional<double>(*value) : std::nullopt;
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

void add_options(CLI::App& command, FidelityArgs& args) {
  command
      .add_option("--accuracy", args.accuracy,
                  "largest error of the simulated force, 10mN or 0.5% of 5 N: the fastest measured "
                  "setting of the plant that keeps it")
      ->check(problem_of(sim::parse_accuracy_n));
  command
      .add_option("--budget", args.budget,
                  "least speed of the plant, 1000x real time: the most accurate measured setting "
                  "that reaches it")
      ->check(problem_of(sim::parse_times_real_time));
}

FidelityRequest fidelity_request(const FidelityArgs& args) {
  return {read(args.accuracy, sim::parse_accuracy_n),
          read(args.budget, sim::parse_times_real_time)};
}

}  // namespace weft::daemon::cli
