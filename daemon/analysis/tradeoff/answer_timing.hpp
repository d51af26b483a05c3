#pragma once
// How long an answer takes: features and vote, one trial at a time on the calling thread.

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/features/layout.hpp"
#include "daemon/analysis/tradeoff/material.hpp"
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
class AnswerTiming {
 public:
  void add(TimedAnswer one) { all_.push_back(std::move(one)); }
  /// In the order of add().
  Result<std::vector<AnswerTimes>> run(std::size_t repetitions,
                                       const classifier::FeatureOptions& options,
                                       const classifier::SecondsNow& seconds_now) const;

 private:
  std::vector<TimedAnswer> all_;
};

}  // namespace weft::daemon
