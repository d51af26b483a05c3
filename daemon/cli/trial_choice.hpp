#pragma once
// From a data set file to the feature matrix of a command: which trials, whole or in windows.

#include <filesystem>
#include <string>
#include <vector>

#include "classifier/fabric/model_file.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "daemon/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

/// Options that features, train and evaluate share.
struct TrialChoice {
  std::string exploration;     ///< empty: all; needed when the data set has several
  double window_s = 0.0;       ///< 0: whole strokes
  double window_step_s = 0.0;  ///< 0: no overlap
  std::string norm = "l2";
};
void add_trial_options(CLI::App& command, TrialChoice& choice);

/// A data set and the features of the trials that were chosen from it.
struct ChosenTrials {
  Dataset dataset;
  std::string sha256;
  std::size_t strokes = 0;  ///< chosen trials before they were cut into windows
  classifier::FeatureMatrix features;
  classifier::FeatureSetup setup;
};

/// The explorations in a data set, in order of appearance.
std::vector<std::string> explorations_of(const Dataset& dataset);

/// Complete trials of the chosen exploration, cut into windows where asked for. Refuses an
/// exploration that is not there, and several of them in `one_exploration` mode: M1 and M2 are
/// different experiments.
Result<std::vector<classifier::Trial>> choose_trials(const Dataset& dataset,
                                                     const TrialChoice& choice,
                                                     bool one_exploration);

/// Reads `path`, chooses and extracts.
Result<ChosenTrials> load_trials(const std::filesystem::path& path, const TrialChoice& choice,
                                 bool one_exploration);

/// Mean sample period of a data set [s]; 0 when not known.
double sample_period_s(const Dataset& dataset);

/// "SIMULATED data ..." or "" for real data: every text with figures starts with it.
std::string bench_banner(BenchKind kind);

}  // namespace weft::daemon::cli
