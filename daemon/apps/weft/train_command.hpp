#pragma once
// `weft fabric train`: all complete trials of a data set into a model file; the options of a
// training.

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

/// What is wrong with `text` as a seed, or nothing. CLI11 by itself takes -1 and saturates numbers
/// that are too large, so that another seed than the one asked for would be used.
std::string seed_problem(const std::string& text);

void add_train_options(CLI::App& command, TrainChoice& choice);

/// `paper_selection`: p-values once from all training trials, and ties of the grid search to the
/// smallest parameters (reference AMB-15, AMB-16).
classifier::TrainOptions train_options(const TrainChoice& choice);

/// What a training by `options` counted as not solved, as a line that warns; nothing where all
/// were.
std::string unconverged_text(const classifier::TrainOptions& options);

/// One line for people. `folds`: in what they are not as chosen, words_of().
std::string describe(const TrainChoice& choice, const std::string& folds = {});
/// The same for the model file, with the rule for ties that a training on so many fabrics used.
std::string describe(TrainChoice choice, std::size_t fabrics, const std::string& folds);

struct TrainArgs {
  std::filesystem::path dataset;
  std::filesystem::path out;
  std::string learner = "best";
  bool live = false;  ///< a staged model: votes while a slide goes on
  TrialChoice trials;
  TrainChoice training;
  RecordingChoice recordings;  ///< of sound and vibration; one method
};
void add_options(CLI::App& command, TrainArgs& args);

Result<int> run_train_recordings(const TrainArgs& args, Console& console);

/// Trains on slides or imprints, with the training itself done by `trainer`, which must give what
/// train_learner() would; the file then is the same too, byte for byte.
using Trainer = std::function<Result<classifier::ChosenLearner>(
    const ChosenTrials& chosen, classifier::Learner learner,
    const classifier::TrainOptions& options)>;
Result<int> run_train_with(const Trainer& trainer, const TrainArgs& args, Console& console);

}  // namespace weft::daemon::cli
