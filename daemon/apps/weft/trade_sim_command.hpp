#pragma once
// `weft trade sim`: what accuracy of the plant costs in processor time.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/apps/weft/console.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct TradeSimArgs {
  std::filesystem::path out;        ///< page
  std::filesystem::path data;       ///< JSON; empty: not written
  std::filesystem::path table;      ///< sim/fidelity.json; empty: not written
  std::filesystem::path reference;  ///< trajectories of another solver; empty: the finest run
  std::filesystem::path fabrics = "sim/fabrics.json";
  std::vector<std::string> scenes;  ///< empty: all; "none"
  bool quick = false;
  std::size_t timings = 7;
  bool downstream = false;
  std::size_t seeds = 5;   ///< of downstream
  std::size_t trials = 8;  ///< of downstream: on each swatch
};
void add_options(CLI::App& command, TradeSimArgs& args);

Result<int> run_trade_sim(const TradeSimArgs& args, Console& console);

}  // namespace weft::daemon::cli
