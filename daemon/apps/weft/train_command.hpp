#pragma once
// `weft fabric train`: all complete trials of a data set into a model file; training options.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "classifier/fabric/options.hpp"
#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/evaluate_recordings.hpp"
#include "daemon/apps/weft/trial_choice.hpp"

namespace weft::daemon::cli {

/// Options of the training that `weft fabric train`, `evaluate` and `trade classifier` share.
struct TrainChoice {
  std::uint64_t seed = 1;
  std::size_t cap = 20;
  std::size_t folds = 5;
  std::string fold_unit = "recording";
  bool paper_selection = false;
  std::string t_test = "pooled";
  std::string solver = "own";
  std::string tie = "auto";
  std::size_t threads = 0;
  double time_budget_s = 60.0;  ///< classifier::TrainOptions::budget
};

/// The error in `text` as a seed; empty if it is valid. CLI11 itself accepts -1 and saturates
/// numbers that are too large, which would silently use another seed.
std::string seed_problem(const std::string& text);

void add_train_options(CLI::App& command, TrainChoice& choice);

/// `paper_selection`: p-values once from all training trials, and ties of the grid search to the
/// smallest parameters (reference AMB-15, AMB-16).
classifier::TrainOptions train_options(const TrainChoice& choice);

/// A warning line with the number of trainings by `options` that did not converge; empty if all
/// did.
std::string unconverged_text(const classifier::TrainOptions& options);

/// One line for people. `folds`: format_folds().
std::string describe(const TrainChoice& choice, const std::string& folds = {});
/// The same for the model file, with the rule for ties used for this number of fabrics.
std::string describe(TrainChoice choice, std::size_t fabrics, const std::string& folds);

struct TrainArgs {
  std::filesystem::path dataset;
  std::filesystem::path out;
  std::string learner = "best";
  bool live = false;  ///< a staged model: votes during a slide
  TrialChoice trials;
  TrainChoice training;
  RecordingChoice recordings;  ///< sound and vibration; one method
};
void add_options(CLI::App& command, TrainArgs& args);

Result<int> run_train_recordings(const TrainArgs& args, Console& console);

/// Trains on slides or imprints. `trainer` does the training and must return the result of
/// train_learner(); the file is then the same, byte for byte.
using Trainer = std::function<Result<classifier::ChosenLearner>(
    const ChosenTrials& chosen, classifier::Learner learner,
    const classifier::TrainOptions& options)>;
Result<int> run_train_with(const Trainer& trainer, const TrainArgs& args, Console& console);

}  // namespace weft::daemon::cli
