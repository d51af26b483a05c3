#include "recipes/engine/plan.hpp"

#include <cmath>

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

/// Finaliser of splitmix64: FNV-1a alone leaves the high bits of short texts poorly mixed.
std::uint64_t mixed(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

}  // namespace

const PhaseStep& Exploration::step(Phase phase) const {
  for (const PhaseStep& candidate : phases)
    if (candidate.phase == phase) return candidate;
  WEFT_ASSERT(false && "a checked exploration has every phase");
  return phases.front();
}

std::string to_string(const Diagnostic& diagnostic) {
  return to_string(Error{Errc::invalid_argument, diagnostic.message,
                         diagnostic.pointer.empty() ? "recipe" : diagnostic.pointer,
                         diagnostic.expected, diagnostic.got, diagnostic.hint});
}

std::uint64_t patch_seed(std::uint64_t recipe_seed, std::string_view fabric,
                         std::string_view exploration, std::uint32_t repetition) {
  std::string key = std::to_string(recipe_seed);
  for (const std::string_view part : {fabric, exploration}) (key += '/') += part;
  (key += '/') += std::to_string(repetition);
  return mixed(fnv1a(key));
}

double move_duration_s(double distance_m, double speed_mps, double acceleration_mps2) {
  const double distance = std::abs(distance_m);
  const double ramps_m = speed_mps * speed_mps / acceleration_mps2;
  if (distance < ramps_m) return 2 * std::sqrt(distance / acceleration_mps2);
  return distance / speed_mps + speed_mps / acceleration_mps2;
}

}  // namespace weft::recipes
