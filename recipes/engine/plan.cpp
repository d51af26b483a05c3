#include "recipes/engine/plan.hpp"

#include <algorithm>
#include <cmath>

namespace weft::recipes {
const PhaseStep& Exploration::step(Phase phase) const {
  for (const PhaseStep& candidate : phases)
    if (candidate.phase == phase) return candidate;
  WEFT_ASSERT(false && "a checked exploration has every phase");
  return phases.front();
}

bool Exploration::slides() const {
  return std::ranges::any_of(phases, [](const PhaseStep& p) { return p.phase == Phase::motion; });
}

const std::vector<Vec2>& Exploration::path_m() const {
  static const std::vector<Vec2> none;
  return slides() ? step(Phase::motion).path_m : none;
}

std::string format_trial(const Plan& plan, std::size_t trial) {
  const TrialSpec& spec = plan.trials[trial];
  return "trial " + std::to_string(spec.index + 1) + " (" + plan.fabrics[spec.fabric] + ", " +
         plan.explorations[spec.exploration].name + ", repetition " +
         std::to_string(spec.repetition) + ")";
}

double move_duration_s(double distance_m, double speed_mps, double acceleration_mps2) {
  const double distance = std::abs(distance_m);
  const double ramps_m = speed_mps * speed_mps / acceleration_mps2;
  if (distance < ramps_m) return 2 * std::sqrt(distance / acceleration_mps2);
  return distance / speed_mps + speed_mps / acceleration_mps2;
}

}  // namespace weft::recipes
