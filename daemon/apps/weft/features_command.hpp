#pragma once
// `weft features`: the feature table of a data set as CSV.

#include <filesystem>

#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/trial_choice.hpp"

namespace weft::daemon::cli {

struct FeaturesArgs {
  std::filesystem::path dataset;
  std::filesystem::path out;
  TrialChoice trials;
};
void add_options(CLI::App& command, FeaturesArgs& args);
Result<int> run_features(const FeaturesArgs& args, Console& console);

}  // namespace weft::daemon::cli
