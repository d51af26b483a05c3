#pragma once
// Common options of the commands on a rig: `run`, `check`, `align` and `doctor`.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/apps/weft/console.hpp"
#include "daemon/campaign/bench_check.hpp"
#include "daemon/campaign/simulation.hpp"
#include "daemon/campaign/trial_recording.hpp"
#include "daemon/hardware/plugins/driver_catalog.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

// `--accuracy` and `--budget`, of the commands that simulate or check a campaign.

struct FidelityArgs {
  std::string accuracy, budget;  ///< as typed; empty: not given
  bool strict = false;           ///< `--accuracy-strict`, of commands that run
};
/// An unreadable text is a usage error.
void add_options(CLI::App& command, FidelityArgs& args);
/// `--accuracy-strict`.
void add_strict_option(CLI::App& command, FidelityArgs& args);

FidelityRequest fidelity_request(const FidelityArgs& args);

// `--set`, of the commands that run or check a recipe.

struct ParameterArgs {
  std::vector<std::string> set;  ///< NAME=VALUE
};
/// An unreadable text is a usage error.
void add_options(CLI::App& command, ParameterArgs& args);

/// {NAME: value} for CampaignRequest; empty without any. 3 and true are a number and a flag; "3"
/// and any other text are texts. A name given twice appears twice.
std::string parameters_json(const ParameterArgs& args);
/// Adds them to the parameters of a call, if there are any. Errors: invalid_argument, for a name
/// given twice.
Status put_parameters(const ParameterArgs& args, nlohmann::json& params);

// `--plugins` and `--plugins-only`, of the commands that create a rig's drivers.

struct PluginArgs {
  std::vector<std::filesystem::path> folders;
  bool only = false;
};
void add_options(CLI::App& command, PluginArgs& args);

/// The folders of the command line, then those of WEFT_PLUGIN_PATH, separated by colons. A plugin
/// that hangs ends the process with exit_failure after the sentence (and the object of --json).
PluginSettings make_settings(const PluginArgs& args, const Console& console);

/// Prints warnings and errors of a driver at once on `err`.
void print_device_log(const DeviceLogEntry& line, Console& console);

/// {"pointer", "message", "expected", "got", "hint", "sentence"}
nlohmann::json diagnostic_json(const recipes::Diagnostic& diagnostic);

/// Prints every problem under the name of its file; with --json also in the error object. Returns
/// exit_failure.
int refuse(const std::vector<FileProblem>& problems, Console& console);

/// Differences from a good end, and advice; empty if the probe is up and no step was left out.
std::string format_rig(recipes::Cleanup cleanup, recipes::RigFact rig);

}  // namespace weft::daemon::cli
