#pragma once
// `weft run`: a campaign from recipe to data set, classified and reported.

#include <cstdint>
#include <filesystem>
#include <optional>

#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/plugin_options.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct RunArgs {
  std::filesystem::path recipe;
  std::filesystem::path rig;
  std::filesystem::path out;
  std::optional<std::uint64_t> seed;  ///< in place of the recipe's
  FidelityArgs fidelity;
  PluginArgs plugins;
  bool error_check = true;
  bool evaluate = true;
  bool yes = false;                   ///< operator steps count as done without asking
  bool resume = false;                ///< go on with the campaign in `out`
  std::filesystem::path level;        ///< what weft align --json said; empty: none
  double level_max_age_h = 24;        ///< 0: any age
  bool preview = false;               ///< with resume: say what is left, move nothing
  std::size_t repeats = 30;           ///< random splits of the evaluation
  std::filesystem::path socket = {};  ///< OUT/weftd.sock where it is empty
};
void add_options(CLI::App& command, RunArgs& args);

/// exit_failure when not every trial is complete, exit_signal + number after SIGINT or SIGTERM.
Result<int> run_run(const RunArgs& args, Console& console);

}  // namespace weft::daemon::cli
