#pragma once
// A vote while the slide goes on, and the rule that says when it is sure.

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "classifier/features/feature_stream.hpp"
#include "classifier/live/staged_model.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// What the model says of a slide so far.
struct LivePrediction {
  double slide_s = 0;               ///< of phase M that it has seen, by the nominal sample rate
  std::size_t winner = 0;           ///< index into the learner's labels()
  std::vector<double> probability;  ///< per label; empty where the model has no aids
  bool none_of_these = false;       ///< nothing that it was trained on is like this
};

/// When a slide has told enough.
struct StopRule {
  double sure_probability = 0.95;  ///< of the winner
  double least_slide_s = 0;        ///< to rate_rounding
};

/// A vote without probability, and one for a stranger, is never sure.
bool is_sure(const StopRule& rule, const LivePrediction& answer);

/// Feeds frames to the streaming features and asks each stage of the model when its time has come.
/// A look costs one evaluation of Table I, its tables the first time, and one answer; all other
/// frames cost nanoseconds. Not for two threads at once.
class LiveVoter {
 public:
  /// `model` has a stage.
  explicit LiveVoter(std::shared_ptr<const StagedModel> model);

  /// A new trial.
  void restart();
  /// One frame, `counts` [taxels]. An answer where a look was due. Refuses what the features and
  /// the model refuse.
  Result<std::optional<LivePrediction>> add(Phase phase, std::span<const double> counts);

  [[nodiscard]] const StagedModel& model() const { return *model_; }

 private:
  [[nodiscard]] bool consumes(Phase phase) const;
  Result<LivePrediction> check();

  std::shared_ptr<const StagedModel> model_;
  FeatureStream stream_;
  std::size_t next_stage_ = 0;
};

}  // namespace weft::classifier
