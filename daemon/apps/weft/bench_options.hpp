#pragma once
// What the commands on a rig share: `run`, `check`, `align` and `doctor`.

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

// `--accuracy` and `--budget`, of the commands that simulate a campaign or look at one.

struct FidelityArgs {
  std::string accuracy, budget;  ///< as typed; empty: not asked for
  bool strict = false;           ///< `--accuracy-strict`, of commands that run
};
/// A text that cannot be read is refused with the command line.
void add_options(CLI::App& command, FidelityArgs& args);
/// `--accuracy-strict`.
void add_strict_option(CLI::App& command, FidelityArgs& args);

FidelityRequest fidelity_request(const FidelityArgs& args);

// `--set`, of the commands that run or check a recipe.

struct ParameterArgs {
  std::vector<std::string> set;  ///< NAME=VALUE
};
/// A text that cannot be read is refused with the command line.
void add_options(CLI::App& command, ParameterArgs& args);

/// {NAME: value} as CampaignRequest takes it, empty without any: 3 and true are a number and a
/// flag, "3" and anything else a text. A name that was given twice is in it twice.
std::string parameters_json(const ParameterArgs& args);
/// Puts them into the parameters of a call, where there are any. Errors: invalid_argument, a name
/// given twice.
Status put_parameters(const ParameterArgs& args, nlohmann::json& params);

// `--plugins` and `--plugins-only`, of the commands that make a rig's drivers.

struct PluginArgs {
  std::vector<std::filesystem::path> folders;
  bool only = false;
};
void add_options(CLI::App& command, PluginArgs& args);

/// The folders of the command line, then those of WEFT_PLUGIN_PATH, separated by colons. A plugin
/// that hangs ends the process with exit_failure after the sentence (and the object of --json).
PluginSettings make_settings(const PluginArgs& args, const Console& console);

/// Warnings and errors of a driver, as they come, on `err`.
void print_device_log(const DeviceLogEntry& line, Console& console);

/// {"pointer", "message", "expected", "got", "hint", "sentence"}
nlohmann::json diagnostic_json(const recipes::Diagnostic& diagnostic);

/// Every problem under the name of its file; with --json also in the error object. Returns
/// exit_failure.
int refuse(const std::vector<FileProblem>& problems, Console& console);

/// What is not as after a good end, and what to do; empty where the probe is up and nothing was
/// left out.
std::string format_rig(recipes::Cleanup cleanup, recipes::RigFact rig);

}  // namespace weft::daemon::cli
