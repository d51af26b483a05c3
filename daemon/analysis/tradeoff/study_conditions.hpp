#pragma once
// Which choices `weft trade classifier` tries: the default and what differs from it in one setting.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "classifier/vote/vote.hpp"
#include "daemon/analysis/tradeoff/material.hpp"
#include "daemon/analysis/tradeoff/measure_classifier.hpp"

namespace weft::daemon {

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
  [[nodiscard]] bool same_material(const StudyCondition& other) const;
  /// The same machines answer.
  [[nodiscard]] bool same_training(const StudyCondition& other) const;
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
