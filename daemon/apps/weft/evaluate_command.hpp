#pragma once
// `weft evaluate`: train and test on splits of a data set.

#include <filesystem>
#include <string>
#include <vector>

#include "classifier/evaluate/splits.hpp"
#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/evaluate_recordings.hpp"
#include "daemon/apps/weft/train_options.hpp"
#include "daemon/apps/weft/trial_choice.hpp"

namespace weft::daemon::cli {

struct EvaluateArgs {
  std::filesystem::path dataset;
  std::vector<std::string> train_groups;
  std::vector<std::string> test_groups;
  double train_fraction = 0.0;  ///< 0: by groups
  bool leave_one_group_out = false;
  std::size_t repeats = 30;
  std::size_t permute_labels = 0;  ///< permutations to try as well; 0: none
  std::vector<std::string> learners = {"every"};
  std::vector<std::size_t> curve;  ///< training recordings of each label; empty: all
  bool calibration = false;        ///< probabilities of test answers too; --report implies it
  bool none_of_these = false;      ///< every fabric left out in turn and shown
  std::filesystem::path report;    ///< page to write; empty: none
  bool answers = false;            ///< with --json: list them
  std::size_t curve_draws = 5;     ///< of each split and number
  TrialChoice trials;
  TrainChoice training;
  RecordingChoice recordings;
};
void add_options(CLI::App& command, EvaluateArgs& args);

/// One split by groups, one for each group left out, or `repeats` random ones. Refuses random
/// splits of windows: windows of one recording would be on both sides.
Result<std::vector<classifier::Split>> make_splits(const EvaluateArgs& args,
                                                   const classifier::FeatureMatrix& features);

Result<int> run_evaluate(const EvaluateArgs& args, Console& console);

}  // namespace weft::daemon::cli
