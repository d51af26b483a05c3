#pragma once
// `weft trade vibro`: F-score against time on recordings of sound and vibration.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/apps/weft/console.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct TradeVibroArgs {
  std::vector<std::filesystem::path> datasets;
  std::filesystem::path out;   ///< page
  std::filesystem::path data;  ///< JSON; empty: not written
  std::vector<std::string> methods;
  std::vector<std::string> families;
  std::string exploration;  ///< of campaigns; empty: the only one there is
  std::vector<double> windows_s = {1.0, 2.0};
  std::size_t blocks = 5;
  double step_s = 0.25;
  std::size_t per_recording = 100;
  std::size_t repeats = 5;
  std::size_t timings = 101;
  std::uint64_t seed = 1;
};
void add_options(CLI::App& command, TradeVibroArgs& args);

Result<int> run_trade_vibro(const TradeVibroArgs& args, Console& console);

}  // namespace weft::daemon::cli
