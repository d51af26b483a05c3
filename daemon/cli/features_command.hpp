#pragma once
// `weft features`: the feature table of a data set as CSV.

#include <filesystem>

#include "daemon/cli/console.hpp"
#include "daemon/cli/trial_choice.hpp"

namespace weft::daemon::cli {

struct FeaturesArgs {
  std::filesystem::path dataset;
  std::filesystem::path out;
  TrialChoice trials;
};
void add_options(CLI::App& command, FeaturesArgs& args);
Result<int> run_features(const FeaturesArgs& args, Console& console);

}  // namespace weft::daemon::cli
