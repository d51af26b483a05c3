#pragma once
// `weft imprint scene` and `weft imprint tables`.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/apps/weft/console.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct ImprintSceneArgs {
  std::filesystem::path out;
  std::string level = "Z+";
  std::size_t side = 32;
  std::size_t presses = 1;
  std::uint64_t seed = 1;
};
void add_options(CLI::App& command, ImprintSceneArgs& args);
/// Makes a data set of simulated imprints.
Result<int> run_imprint_scene(const ImprintSceneArgs& args, Console& console);

struct ImprintTablesArgs {
  std::filesystem::path dataset;
  std::filesystem::path out;  ///< page; empty: none
  std::vector<std::string> experiments;
  std::vector<std::string> rules;
  std::vector<std::string> scales;  ///< "1,2,4"; empty: the paper's
  bool no_laws = false;
};
void add_options(CLI::App& command, ImprintTablesArgs& args);
/// The tables of Ellis 1986 on a data set of imprints.
Result<int> run_imprint_tables(const ImprintTablesArgs& args, Console& console);

}  // namespace weft::daemon::cli
