#include "recipes/engine/trial_order.hpp"

#include <utility>

#include "recipes/engine/splitmix.hpp"

namespace weft::recipes {
namespace {

/// Uniform in [0, bound) without bias: draws in the incomplete last interval are thrown away.
std::uint64_t below(std::uint64_t bound, std::uint64_t& state) {
  const std::uint64_t remainder = (UINT64_MAX % bound + 1) % bound;
  std::uint64_t draw = next_splitmix64(state);
  while (draw > UINT64_MAX - remainder) draw = next_splitmix64(state);
  return draw % bound;
}

std::vector<TrialSpec> blocked(const StatedRecipe& stated) {
  std::vector<TrialSpec> trials;
  for (std::size_t f = 0; f < stated.fabrics.size(); ++f)
    for (std::size_t e = 0; e < stated.explorations.size(); ++e)
      for (std::uint32_t r = 1; r <= stated.repetitions; ++r)
        trials.push_back({0, f, e, r,
                          patch_seed(stated.seed, stated.fabrics[f],
                                     stated.explorations[e].exploration.name, r)});
  return trials;
}

}  // namespace

std::vector<TrialSpec> ordered_trials(const StatedRecipe& stated) {
  std::vector<TrialSpec> trials = blocked(stated);
  if (stated.order == Order::randomised) {
    std::uint64_t state = stated.order_seed;
    for (std::size_t i = trials.size(); i > 1; --i)
      std::swap(trials[i - 1], trials[below(i, state)]);
  }
  for (std::size_t i = 0; i < trials.size(); ++i) trials[i].index = i;
  return trials;
}

}  // namespace weft::recipes
