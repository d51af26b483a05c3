#pragma once
// Options of the training that `weft train` and `weft evaluate` share.

#include <cstdint>
#include <string>

#include "classifier/fabric/options.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

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
};

/// What is wrong with `text` as a seed, or nothing. CLI11 by itself takes -1 and saturates numbers
/// that are too large, so that another seed than the one asked for would be used.
std::string seed_problem(const std::string& text);

void add_train_options(CLI::App& command, TrainChoice& choice);

/// `paper_selection`: p-values once from all training trials, and ties of the grid search to the
/// smallest parameters (reference AMB-15, AMB-16).
classifier::TrainOptions train_options(const TrainChoice& choice, classifier::Reduction reduction);

/// What a training by `options` counted as not solved, as a line that warns; nothing where all
/// were.
std::string unconverged_text(const classifier::TrainOptions& options);

/// One line for people. `folds`: in what they are not as chosen, words_of().
std::string describe(const TrainChoice& choice, const std::string& folds = {});
/// The same for the model file, with the rule for ties that a training on so many fabrics used.
std::string describe(TrainChoice choice, std::size_t fabrics, const std::string& folds);

}  // namespace weft::daemon::cli
