#pragma once
// `weft design`: which setting a pilot study recommends, and how many repetitions are enough.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/trial_choice.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct DesignAnalyseArgs {
  std::vector<std::filesystem::path> datasets;
  std::filesystem::path out;  ///< page; empty: not written
  std::string learner = "lda";
  std::size_t resamples = 2000;
  std::uint64_t seed = 1;
  double shortest_mm = 0.2, longest_mm = 5;
};
void add_options(CLI::App& command, DesignAnalyseArgs& args);
Result<int> run_design_analyse(const DesignAnalyseArgs& args, Console& console);

struct DesignRepetitionsArgs {
  std::filesystem::path dataset;
  std::filesystem::path out;  ///< page; empty: not written
  TrialChoice trials;
  std::string learner = "pvalue";
  std::size_t predict = 20;
  double accuracy = 0.9;
  std::size_t most = 200;
  std::size_t first = 0;
  bool strokes = false;
  std::size_t draws = 4;
  std::size_t resamples = 2000;
  std::uint64_t seed = 1;
};
void add_options(CLI::App& command, DesignRepetitionsArgs& args);
Result<int> run_design_repetitions(const DesignRepetitionsArgs& args, Console& console);

}  // namespace weft::daemon::cli
