#pragma once
// `weft trade classifier`: accuracy against time, on one picture for each data set.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/analysis/tradeoff/tradeoff_page.hpp"
#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/evaluate_command.hpp"

namespace weft::daemon::cli {

struct TradeClassifierArgs {
  std::vector<std::filesystem::path> datasets;
  std::filesystem::path out;      ///< page
  std::filesystem::path data;     ///< JSON; empty: not written
  std::vector<std::string> vary;  ///< families; empty: all
  std::string learner = "pvalue";
  std::string exploration;  ///< of the default; empty: each data set's first
  std::string norm = "l2";
  std::vector<std::string> train_groups;
  std::vector<std::string> test_groups;
  bool leave_one_group_out = false;
  double train_fraction = 0.0;  ///< 0: by groups, or what suits the data set
  std::size_t splits = 10;      ///< at most
  std::size_t timings = 9;
  TrainChoice training;
};
void add_options(CLI::App& command, TradeClassifierArgs& args);

/// What it measures; `text` gets its tables, for a terminal.
Result<TradeoffReport> measured_tradeoff(const TradeClassifierArgs& args, Console& console,
                                         std::string& text);
Result<int> run_trade_classifier(const TradeClassifierArgs& args, Console& console);

}  // namespace weft::daemon::cli
