#pragma once
// The rule that ends a slide once its vote is sure, on recorded slides: how far it lets them go,
// and how often it is right. The voter is the one that runs while a real slide goes on.

#include <functional>
#include <memory>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/live/staged_model.hpp"
#include "daemon/analysis/tradeoff/material.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// What the vote was on one slide that did not train.
struct WatchedSlide {
  std::size_t truth = 0;                                ///< index into the learner's labels
  std::vector<classifier::LivePrediction> evaluations;  ///< one for each stage that it came to
  std::size_t at_end = 0;                               ///< what the whole trial is called
  double whole_s = 0;                                   ///< of phase M
};

/// One split: a staged model of its training part, and every test slide watched by it.
struct WatchedSplit {
  std::shared_ptr<const classifier::StagedModel> model;
  std::vector<WatchedSlide> slides;
};

/// Index of the label that a whole trial is given, by its row of the material.
using AnswerAtEnd = std::function<Result<std::size_t>(std::size_t row)>;

/// Trains on the slides of the training rows and watches those of the test rows. Rows of one
/// exploration each. Refuses what train_staged() refuses, and a label that never trained.
Result<WatchedSplit> watch_slides(const Dataset& dataset, const Material& material,
                                  const classifier::Split& split,
                                  const classifier::StagedOptions& options,
                                  const AnswerAtEnd& at_end);

/// How the slides of a split would have ended under a rule; one that is never sure goes on to its
/// whole length and is asked about with all that was recorded.
struct EarlyStops {
  std::size_t right = 0, tested = 0, stopped = 0;
  double slide_s = 0;  ///< of all together
};
EarlyStops evaluate_rule(const WatchedSplit& split, const classifier::StopRule& rule);

}  // namespace weft::daemon
