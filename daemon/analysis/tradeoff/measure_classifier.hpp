#pragma once
// `weft trade classifier`: the classifier's settings, varied one family at a time around a default,
// each trained and tested on the same splits and timed in the same run.

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/features/layout.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/vote/vote.hpp"
#include "daemon/analysis/tradeoff/material.hpp"
#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// What may be varied.
enum class TradeoffFamily {
  features,     ///< feature count N of the cores
  learner,      ///< kinds of cores, LDA, SVC, trees, the choice between them
  slide,        ///< first seconds of phase M
  speed,        ///< one speed's trials at a time, where names of recordings tell it
  exploration,  ///< the others of the data set, and each pair side by side
  vote,         ///< soft, DAG, short-lists
  stop          ///< slides that end once a live vote is sure
};
/// "features", "learner" ...
std::string_view to_string(TradeoffFamily family);
/// Refuses another word; says which one was probably meant.
Result<TradeoffFamily> tradeoff_family_from(std::string_view word);
std::vector<TradeoffFamily> all_tradeoff_families();

/// How to split a feature matrix, and how that is said to a reader.
struct SplitPlan {
  std::vector<classifier::Split> splits;
  std::string words;
  bool groups_left_out = false;  ///< each group tests once
};
using SplitMaker = std::function<Result<SplitPlan>(const classifier::FeatureMatrix&)>;

struct ClassifierTradeoffOptions {
  std::vector<TradeoffFamily> vary = all_tradeoff_families();
  classifier::Learner learner = classifier::Learner::pvalue;  ///< of the default
  classifier::TrainOptions training;                          ///< cap: the default's N
  classifier::FeatureOptions features;
  std::string exploration;  ///< of the default; empty: the data set's first
  SplitMaker split;
  std::size_t timings = 9;        ///< repetitions of which the median counts, at least 5
  std::size_t timed_trials = 16;  ///< answers in each, spread over the trials
};

/// Before each piece of work: which one, out of how many, what.
using TradeoffProgress = std::function<void(std::size_t, std::size_t, const std::string&)>;

/// The default comes first, then the families in the order of TradeoffFamily. Accuracy and interval
/// are those of classifier::evaluate(): the mean over the splits with split_interval(), or Wilson's
/// of a single split.
/// Answers (features and vote, one thread) are timed after all trainings, the points in turn in
/// each repetition, so that a busy moment of the machine falls on all of them. The TradeoffSet's
/// `dataset` and `sha256` are the caller's to fill. Refuses what training and splitting refuse,
/// fewer than 5 timings, and options of which nothing can be varied on this data set.
Result<TradeoffSet> measure_classifier_tradeoff(const Dataset& dataset,
                                                const ClassifierTradeoffOptions& options,
                                                const classifier::SecondsNow& seconds_now,
                                                const TradeoffProgress& progress = {});

/// Compute time of one answer, and seconds of sliding.
const std::vector<TradeoffCost>& classifier_costs();

// Which choices it tries: the default and what differs from it in one setting.

/// One choice, not yet measured.
struct StudyCondition {
  std::string name;
  std::string family;
  std::string exploration;
  double slide_s = 0;  ///< 0: whole
  classifier::Learner learner = classifier::Learner::pvalue;
  std::size_t cap = 20;
  classifier::VoteOptions vote;
  std::optional<double> speed_mm_s;  ///< test trials of this speed alone
  std::optional<double> sure;        ///< slides end at this probability

  /// Trials are prepared and split as for `other`.
  [[nodiscard]] bool same_material(const StudyCondition& other) const {
    return exploration == other.exploration && slide_s == other.slide_s;
  }
  /// The same machines answer.
  [[nodiscard]] bool same_training(const StudyCondition& other) const {
    return same_material(other) && learner == other.learner && cap == other.cap;
  }
};

/// Of the arms whose slides end early: the first stage of their model.
inline constexpr double least_slide_s = 0.5;

struct TradeoffPlan {
  std::vector<StudyCondition> arms;                           ///< the default first
  std::vector<std::pair<std::string, std::string>> left_out;  ///< family, why
};

/// `base` is what the default is prepared to; of `labels` classes.
TradeoffPlan plan_tradeoff(const Dataset& dataset, const Material& base, std::size_t labels,
                           const std::string& exploration,
                           const ClassifierTradeoffOptions& options);

std::vector<Setting> list_settings(const StudyCondition& arm,
                                   const ClassifierTradeoffOptions& options);

}  // namespace weft::daemon
