#pragma once
// `weft imprint search`.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/apps/weft/console.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct ImprintSearchArgs {
  std::filesystem::path dataset;
  std::vector<std::string> groups;  ///< to learn from; empty: all
  std::string scales = "0,0.5,1,1.5,2,2.5,3,3.5,4,5,6";
  std::size_t most_scales = 3;
  std::string form = "10";
  std::string rule = "least-squares";
  std::string evaluated_by = "2/N";
  std::size_t shown = 10;
};
void add_options(CLI::App& command, ImprintSearchArgs& args);
/// The sets of scales that tell the classes of a data set apart best.
Result<int> run_imprint_search(const ImprintSearchArgs& args, Console& console);

}  // namespace weft::daemon::cli
