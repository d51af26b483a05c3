#pragma once
// `weft classify`: a stored model's answer for one trial or for every trial of a data set.

#include <cstddef>
#include <filesystem>
#include <string>

#include "daemon/apps/weft/console.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct ClassifyArgs {
  std::filesystem::path model;
  std::filesystem::path trials;  ///< a trial (CSV) or a data set (HDF5); "-": standard input
  std::string vote = "majority";
  std::size_t shortlist = 20;
  bool shortlist_given = false;  ///< on the command line
};
void add_options(CLI::App& command, ClassifyArgs& args);
Result<int> run_classify(const ClassifyArgs& args, Console& console);

}  // namespace weft::daemon::cli
