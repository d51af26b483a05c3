#pragma once
// `weft train`: all complete trials of a data set into a model file.

#include <filesystem>
#include <functional>
#include <string>

#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/evaluate_recordings.hpp"
#include "daemon/apps/weft/train_options.hpp"
#include "daemon/apps/weft/trial_choice.hpp"

namespace weft::daemon::cli {

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
Result<int> run_train(const TrainArgs& args, Console& console);

/// The same with the training itself done by `trainer`, which must give what train_learner() would;
/// the file then is the same too, byte for byte.
using Trainer = std::function<Result<classifier::ChosenLearner>(
    const ChosenTrials& chosen, classifier::Learner learner,
    const classifier::TrainOptions& options)>;
Result<int> run_train_with(const Trainer& trainer, const TrainArgs& args, Console& console);

}  // namespace weft::daemon::cli
