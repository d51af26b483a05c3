#include "recipes/engine/plan.hpp"

#include <algorithm>
#include <cmath>

#include "recipes/engine/splitmix.hpp"

namespace weft::recipes {
namespace {

std::uint64_t fnv1a(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : text) {
    hash ^= static_cast<std::uint8_t>(c);
    hash *= 0x100000001b3;
  }
  return hash;
}

}  // namespace

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

std::uint64_t patch_seed(std::uint64_t recipe_seed, std::string_view fabric,
                         std::string_view exploration, std::uint32_t repetition) {
  std::string key = std::to_string(recipe_seed);
  for (const std::string_view part : {fabric, exploration}) (key += '/') += part;
  (key += '/') += std::to_string(repetition);
  // FNV-1a alone leaves the high bits of short texts poorly mixed.
  return splitmix64_finish(fnv1a(key) + splitmix64_gamma);
}

double move_duration_s(double distance_m, double speed_mps, double acceleration_mps2) {
  const double distance = std::abs(distance_m);
  const double ramps_m = speed_mps * speed_mps / acceleration_mps2;
  if (distance < ramps_m) return 2 * std::sqrt(distance / acceleration_mps2);
  return distance / speed_mps + speed_mps / acceleration_mps2;
}

}  // namespace weft::recipes
