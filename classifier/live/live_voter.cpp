#include "classifier/live/live_voter.hpp"

#include <utility>

namespace weft::classifier {

bool is_sure(const StopRule& rule, const LivePrediction& answer) {
  if (answer.none_of_these || answer.winner >= answer.probability.size()) return false;
  return answer.slide_s >= rule.least_slide_s * (1 - rate_rounding) &&
         answer.probability[answer.winner] >= rule.sure_probability;
}

LiveVoter::LiveVoter(std::shared_ptr<const StagedModel> model)
    : model_(std::move(model)),
      stream_(model_->last().setup.taxels, model_->last().setup.options) {}

void LiveVoter::restart() {
  stream_.restart();
  next_stage_ = 0;
}

// Phases that the model does not know would be features that it does not take.
bool LiveVoter::consumes(Phase phase) const {
  const PhaseSet& known = model_->last().setup.phases;
  return phase == Phase::motion || (phase == Phase::rest && known.rest) ||
         (phase == Phase::press && known.press);
}

Result<std::optional<LivePrediction>> LiveVoter::add(Phase phase, std::span<const double> counts) {
  if (!consumes(phase) || next_stage_ == model_->stages.size())
    return std::optional<LivePrediction>{};
  if (Status ok = stream_.add(phase, counts); !ok) return pass(ok.error(), "live vote");
  if (stream_.motion_frames() < model_->stages[next_stage_].motion_frames)
    return std::optional<LivePrediction>{};
  auto answer = check();
  ++next_stage_;
  if (!answer) return pass(answer.error(), "live vote");
  return std::optional<LivePrediction>(std::move(*answer));
}

Result<LivePrediction> LiveVoter::check() {
  const StoredModel& model = model_->stages[next_stage_].model;
  const auto features = stream_.features();
  if (!features) return pass(features.error());
  auto predicted = predict(model.learner, model.postprocessing, *features);
  if (!predicted) return pass(predicted.error());
  LivePrediction out;
  out.slide_s = model_->slide_s(next_stage_);
  out.winner = predicted->ballot.winner;
  out.probability = std::move(predicted->probability);
  out.none_of_these = predicted->none_of_these;
  return out;
}

}  // namespace weft::classifier
