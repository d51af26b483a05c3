#pragma once
// Functions shared by the commands of `weft trade` and used by `weft report`.

#include <nlohmann/json_fwd.hpp>
#include <span>

#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/evaluate_outcome.hpp"

namespace weft::daemon::cli {

/// The page, and the file of its data.
struct TradeoffFiles {
  std::filesystem::path page;
  std::filesystem::path data;  ///< JSON; empty: not written
};
/// check_page(), unless --data is the page's record itself.
Status check_page(std::span<const std::filesystem::path> inputs, const TradeoffFiles& files);
/// --output and --data.
void add_options(CLI::App& command, TradeoffFiles& files);

struct TradeClassifierArgs : SplitChoice {
  std::vector<std::filesystem::path> datasets;
  TradeoffFiles files;
  std::vector<std::string> vary;  ///< families; empty: all
  std::string learner = "pvalue";
  std::string exploration;  ///< of the default; empty: each data set's first
  std::string norm = "l2";
  std::size_t splits = 10;  ///< at most
  std::size_t timings = 9;
  TrainChoice training;
};
void add_options(CLI::App& command, TradeClassifierArgs& args);

/// Measures the trade-off; `text` gets its tables, for a terminal.
Result<TradeoffReport> measured_tradeoff(const TradeClassifierArgs& args, Console& console,
                                         std::string& text);

/// Writes the page and its data, and prints `text` and the path of the page. `more_of_set`: more
/// JSON keys for each data set of the report; empty: none.
Result<int> write_tradeoff(const TradeoffFiles& files, const TradeoffReport& report,
                           const std::string& text, Console& console,
                           std::span<const nlohmann::ordered_json> more_of_set);
Result<int> write_tradeoff(const TradeoffFiles& files, const TradeoffReport& report,
                           const std::string& text, Console& console);
/// Invalid UTF-8 becomes U+FFFD.
Status write_json(const std::filesystem::path& file, const nlohmann::ordered_json& object,
                  int indent);

/// Prints the current step on `err`.
void print_step(Console& console, std::size_t step, std::size_t steps, const std::string& what);

void add_trade_vibro_command(const CommandGroup& trade);
void add_trade_sim_command(const CommandGroup& trade);

}  // namespace weft::daemon::cli
