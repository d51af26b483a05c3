#pragma once
// How soon an answer is there: the time that features and vote take, one trial at a time on the
// calling thread; and the rule that ends a slide once its vote is sure, on recorded slides.

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

/// The class of a feature vector.
using AnswerFunction = std::function<Result<std::size_t>(std::span<const double>)>;

/// Something that answers, and the trials it is asked about; at least one.
struct TimedAnswer {
  std::shared_ptr<const std::vector<AnswerTrials>> trials;
  AnswerFunction answer;
};

/// One figure per trial: median over the repetitions. Every trial is timed by itself, because a
/// window of a tenth of a millisecond is seldom interrupted on a machine that has other work.
struct AnswerTimes {
  std::vector<double> features_s;
  std::vector<double> vote_s;
};

/// Times several things that answer, all in turn in every repetition, after a repetition that does
/// not count: a busy moment of the machine falls on all of them. Features of trials that several
/// share are the same work: timed once in each repetition, and the figure is that of all of them.
/// Tables that depend on the length of a motion are there before its features are timed.
/// In the order of `all`.
Result<std::vector<AnswerTimes>> time_answers(std::span<const TimedAnswer> all,
                                              std::size_t repetitions,
                                              const classifier::FeatureOptions& options,
                                              const classifier::SecondsNow& seconds_now);

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

/// Index of the label of a test trial among those that were trained, sorted. Refuses one that never
/// was; `file` is the trial's.
Result<std::size_t> find_label(const std::vector<std::string>& labels, const std::string& label,
                               const std::string& file);

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
