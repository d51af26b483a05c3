#pragma once
// `weft report`: the report of a campaign that is over, from its folder alone.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/apps/weft/console.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct ReportArgs {
  std::filesystem::path folder;  ///< campaign.sqlite and dataset.h5, of weft run or weftd
  std::filesystem::path out;     ///< page; its JSON document goes beside it
  std::size_t repeats = 30;      ///< random splits, as of weft run
  std::vector<std::string> vary{"features", "learner", "slide"};  ///< of the classifier's trade
  bool no_tradeoff = false;
  std::size_t tradeoff_splits = 5;
  std::filesystem::path fidelity;  ///< table of weft trade sim; empty: no such section
};
void add_options(CLI::App& command, ReportArgs& args);

/// Errors: not_found, where the folder has no data set; verify()'s, the trade's.
Result<int> run_report(const ReportArgs& args, Console& console);

}  // namespace weft::daemon::cli
