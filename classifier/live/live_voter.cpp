#include "classifier/live/live_voter.hpp"

#include <utility>

namespace weft::classifier {

bool is_sure(const StopRule& rule, const LiveAnswer& answer) {
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
bool LiveVoter::takes(Phase phase) const {
  const PhaseSet& known = model_->last().setup.phases;
  return phase == Phase::motion || (phase == Phase::rest && known.rest) ||
         (phase == Phase::press && known.press);
}

Result<std::optional<LiveAnswer>> LiveVoter::add(Phase phase, std::span<const double> counts) {
  if (!takes(phase) || next_stage_ == model_->stages.size()) return std::optional<LiveAnswer>{};
  if (Status ok = stream_.add(phase, counts); !ok) return pass(ok.error(), "live vote");
  if (stream_.motion_frames() < model_->stages[next_stage_].motion_frames)
    return std::optional<LiveAnswer>{};
  auto answer = look();
  ++next_stage_;
  if (!answer) return pass(answer.error(), "live vote");
  return std::optional<LiveAnswer>(std::move(*answer));
}

Result<LiveAnswer> LiveVoter::look() {
  const StoredModel& model = model_->stages[next_stage_].model;
  const auto features = stream_.features();
  if (!features) return pass(features.error());
  auto said = answer(model.learner, model.aids, *features);
  if (!said) return pass(said.error());
  LiveAnswer out;
  out.slide_s = model_->slide_s(next_stage_);
  out.winner = said->ballot.winner;
  out.probability = std::move(said->probability);
  out.none_of_these = said->none_of_these;
  return out;
}

}  // namespace weft::classifier
