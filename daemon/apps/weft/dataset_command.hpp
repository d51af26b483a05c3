#pragma once
// `weft dataset import`, `weft dataset export` and `weft dataset info`.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/apps/weft/console.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct ImportArgs {
  std::filesystem::path source;  ///< a manifest or a folder
  std::filesystem::path out;
  std::string format = "manifest";
  std::string filter = "*";
  std::string shape;                  ///< imprint-table: "28x50"
  std::string group;                  ///< fabricslide: empty is "repetition"
  std::string order;                  ///< icub20: empty is "time"
  std::vector<std::string> channels;  ///< vibtac12; empty: X, Y, Z
};
void add_options(CLI::App& command, ImportArgs& args);
Result<int> run_import(const ImportArgs& args, Console& console);

struct ExportArgs {
  std::filesystem::path campaign;
  std::filesystem::path out;
  bool without_log = false;
};
void add_options(CLI::App& command, ExportArgs& args);
/// The complete trials of a campaign file; says how many were left out.
Result<int> run_export(const ExportArgs& args, Console& console);

struct InfoArgs {
  std::filesystem::path dataset;  ///< or a campaign file
};
void add_options(CLI::App& command, InfoArgs& args);
Result<int> run_info(const InfoArgs& args, Console& console);

}  // namespace weft::daemon::cli
