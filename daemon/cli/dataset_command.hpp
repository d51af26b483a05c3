#pragma once
// `weft dataset import` and `weft dataset info`.

#include <filesystem>
#include <string>

#include "daemon/cli/console.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct ImportArgs {
  std::filesystem::path source;  ///< a manifest or a folder
  std::filesystem::path out;
  std::string format = "manifest";
  std::string filter = "*";
};
void add_options(CLI::App& command, ImportArgs& args);
Result<int> run_import(const ImportArgs& args, Console& console);

struct InfoArgs {
  std::filesystem::path dataset;
};
void add_options(CLI::App& command, InfoArgs& args);
Result<int> run_info(const InfoArgs& args, Console& console);

}  // namespace weft::daemon::cli
