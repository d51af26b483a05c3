#pragma once
// `weft trade classifier`: varies the classifier's settings one family at a time around a default.
// Each choice is trained and tested on the same splits and timed in the same run.

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

/// The settings that can be varied.
enum class TradeoffFamily {
  features,     ///< feature count N of the cores
  learner,      ///< kinds of cores, LDA, SVC, trees, the choice among them
  slide,        ///< first seconds of phase M
  speed,        ///< trials of one speed at a time, if the file names contain it
  exploration,  ///< other explorations of the data set, and pairs side by side
  vote,         ///< soft, DAG, short lists
  stop          ///< slides that end when a live vote is certain
};
/// "features", "learner" ...
std::string_view to_string(TradeoffFamily family);
/// Refuses another word and suggests the most similar one.
Result<TradeoffFamily> tradeoff_family_from(std::string_view word);
std::vector<TradeoffFamily> all_tradeoff_families();

/// The splits of a feature matrix, with a description for the reader.
struct SplitPlan {
  std::vector<classifier::Split> splits;
  std::string words;
  bool groups_left_out = false;  ///< each group is tested once
};
using SplitMaker = std::function<Result<SplitPlan>(const classifier::FeatureMatrix&)>;

struct ClassifierTradeoffOptions {
  std::vector<TradeoffFamily> vary = all_tradeoff_families();
  classifier::Learner learner = classifier::Learner::pvalue;  ///< the default's learner
  classifier::TrainOptions training;                          ///< cap: N of the default
  classifier::FeatureOptions features;
  std::string exploration;  ///< the default's exploration; empty: the data set's first
  SplitMaker split;
  std::size_t timings = 9;        ///< repetitions for the median, at least 5
  std::size_t timed_trials = 16;  ///< predictions per repetition, spread over the trials
};

/// Called before each step: index, number of steps, description.
using TradeoffProgress = std::function<void(std::size_t, std::size_t, const std::string&)>;

/// The default comes first, then the families in the order of TradeoffFamily. Accuracy and interval
/// are those of classifier::evaluate(): the mean over the splits with split_interval(), or Wilson's
/// for a single split. Predictions (features and vote, one thread) are timed after all trainings.
/// Each repetition times all points in turn, so that other load on the machine affects all equally.
/// The caller fills the TradeoffSet's `dataset` and `sha256`. Refuses fewer than 5 timings, options
/// that vary nothing on this data set, and everything that training and splitting refuse.
Result<TradeoffSet> measure_classifier_tradeoff(const Dataset& dataset,
                                                const ClassifierTradeoffOptions& options,
                                                const classifier::SecondsNow& seconds_now,
                                                const TradeoffProgress& progress = {});

/// Compute time of one prediction, and duration of sliding.
const std::vector<TradeoffCost>& classifier_costs();

// The choices to measure: the default, and choices that differ from it in one setting.

/// One choice before its measurement.
struct StudyCondition {
  std::string name;
  std::string family;
  std::string exploration;
  double slide_s = 0;  ///< 0: the whole slide
  classifier::Learner learner = classifier::Learner::pvalue;
  std::size_t cap = 20;
  classifier::VoteOptions vote;
  std::optional<double> speed_mm_s;  ///< only test trials of this speed
  std::optional<double> sure;        ///< slides end at this probability

  /// Both need the same preparation and splits of the trials.
  [[nodiscard]] bool same_material(const StudyCondition& other) const {
    return exploration == other.exploration && slide_s == other.slide_s;
  }
  /// Both need the same trained models.
  [[nodiscard]] bool same_training(const StudyCondition& other) const {
    return same_material(other) && learner == other.learner && cap == other.cap;
  }
};

/// First stage of the model for slides that end early.
inline constexpr double least_slide_s = 0.5;

struct TradeoffPlan {
  std::vector<StudyCondition> arms;                           ///< the default first
  std::vector<std::pair<std::string, std::string>> left_out;  ///< family, reason
};

/// `base`: the material of the default, with `labels` classes.
TradeoffPlan plan_tradeoff(const Dataset& dataset, const Material& base, std::size_t labels,
                           const std::string& exploration,
                           const ClassifierTradeoffOptions& options);

std::vector<Setting> list_settings(const StudyCondition& arm,
                                   const ClassifierTradeoffOptions& options);

}  // namespace weft::daemon
