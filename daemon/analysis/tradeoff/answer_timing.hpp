#pragma once
// Time until a prediction: the time of features and vote, one trial at a time on the calling
// thread. Also the rule that ends a slide when its vote is certain, applied to recorded slides.

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/features/layout.hpp"
#include "classifier/live/staged_model.hpp"
#include "daemon/analysis/tradeoff/material.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Returns the class of a feature vector.
using AnswerFunction = std::function<Result<std::size_t>(std::span<const double>)>;

/// A predictor and the trials used to time it; at least one trial.
struct TimedAnswer {
  std::shared_ptr<const std::vector<AnswerTrials>> trials;
  AnswerFunction answer;
};

/// One value per trial: the median over the repetitions. Every trial is timed by itself: a window
/// of about 0.1 ms is seldom interrupted on a machine with other work.
struct AnswerTimes {
  std::vector<double> features_s;
  std::vector<double> vote_s;
};

/// Times several predictors. Every repetition runs all of them in turn, so that other load on the
/// machine affects all equally. A first repetition is not counted. Features of shared trials are
/// timed once per repetition, and all users get the same value. Tables that depend on the length of
/// a motion exist before its features are timed. Results in the order of `all`.
Result<std::vector<AnswerTimes>> time_answers(std::span<const TimedAnswer> all,
                                              std::size_t repetitions,
                                              const classifier::FeatureOptions& options,
                                              const classifier::SecondsNow& seconds_now);

/// The votes during one test slide.
struct WatchedSlide {
  std::size_t truth = 0;                                ///< index into the learner's labels
  std::vector<classifier::LivePrediction> evaluations;  ///< one for each stage that the slide
                                                        ///< reached
  std::size_t at_end = 0;                               ///< prediction for the whole trial
  double whole_s = 0;                                   ///< duration of phase M
};

/// One split: a staged model of its training part, and its votes on every test slide.
struct WatchedSplit {
  std::shared_ptr<const classifier::StagedModel> model;
  std::vector<WatchedSlide> slides;
};

/// Index of a test trial's label among the trained labels, which are sorted. Refuses a label that
/// was not trained; `file` is the trial's.
Result<std::size_t> find_label(const std::vector<std::string>& labels, const std::string& label,
                               const std::string& file);

/// Index of the predicted label of a whole trial, given by its row of the material.
using AnswerAtEnd = std::function<Result<std::size_t>(std::size_t row)>;

/// Trains on the slides of the training rows and records the votes on the test rows. Each row must
/// have a single exploration. Refuses a label that was not trained, and everything that
/// train_staged() refuses.
Result<WatchedSplit> watch_slides(const Dataset& dataset, const Material& material,
                                  const classifier::Split& split,
                                  const classifier::StagedOptions& options,
                                  const AnswerAtEnd& at_end);

/// How the slides of a split would have ended under a rule. A slide without a certain vote keeps
/// its whole length, and the whole trial is classified.
struct EarlyStops {
  std::size_t right = 0, tested = 0, stopped = 0;
  double slide_s = 0;  ///< sum over all slides
};
EarlyStops evaluate_rule(const WatchedSplit& split, const classifier::StopRule& rule);

}  // namespace weft::daemon
