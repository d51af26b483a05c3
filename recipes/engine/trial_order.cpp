#include "recipes/engine/trial_order.hpp"

#include <numeric>
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

TrialSpec trial_of(const StatedRecipe& stated, std::size_t fabric, std::size_t exploration,
                   std::uint32_t repetition) {
  return {0, fabric, exploration, repetition,
          patch_seed(stated.seed, stated.fabrics[fabric],
                     stated.explorations[exploration].exploration.name, repetition)};
}

template <class Item>
void shuffle(std::vector<Item>& list, std::uint64_t& state) {
  for (std::size_t i = list.size(); i > 1; --i) std::swap(list[i - 1], list[below(i, state)]);
}

/// The trials of a sweep. Each replicate of a fabric is a complete block, drawn anew.
class SweptTrials {
 public:
  SweptTrials(const StatedRecipe& stated, const Sweep& sweep)
      : stated_(stated), sweep_(sweep), state_(sweep.seed) {}

  std::vector<TrialSpec> all() {
    const bool by_replicate = sweep_.block_by == BlockBy::replicate;
    if (by_replicate)
      for (std::uint32_t r = 1; r <= sweep_.replicates; ++r)
        for (const std::size_t f : make_order(stated_.fabrics.size())) add_block(f, r);
    else
      for (std::size_t f = 0; f < stated_.fabrics.size(); ++f)
        for (std::uint32_t r = 1; r <= sweep_.replicates; ++r) add_block(f, r);
    if (sweep_.block_by == BlockBy::none && sweep_.randomised) shuffle(trials_, state_);
    return std::move(trials_);
  }

 private:
  std::vector<std::size_t> make_order(std::size_t count) {
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (sweep_.randomised) shuffle(order, state_);
    return order;
  }

  void add_block(std::size_t fabric, std::uint32_t replicate) {
    for (const std::size_t e : make_order(stated_.explorations.size()))
      trials_.push_back(trial_of(stated_, fabric, e, replicate));
  }

  const StatedRecipe& stated_;
  const Sweep& sweep_;
  std::uint64_t state_;
  std::vector<TrialSpec> trials_;
};

std::vector<TrialSpec> blocked(const StatedRecipe& stated) {
  std::vector<TrialSpec> trials;
  for (std::size_t f = 0; f < stated.fabrics.size(); ++f)
    for (std::size_t e = 0; e < stated.explorations.size(); ++e)
      for (std::uint32_t r = 1; r <= stated.repetitions; ++r)
        trials.push_back(trial_of(stated, f, e, r));
  return trials;
}

std::vector<TrialSpec> shuffled(const StatedRecipe& stated) {
  std::vector<TrialSpec> trials = blocked(stated);
  std::uint64_t state = stated.order_seed;
  shuffle(trials, state);
  return trials;
}

}  // namespace

std::vector<TrialSpec> ordered_trials(const StatedRecipe& stated) {
  std::vector<TrialSpec> trials = stated.sweep ? SweptTrials(stated, *stated.sweep).all()
                                  : stated.order == Order::randomised ? shuffled(stated)
                                                                      : blocked(stated);
  for (std::size_t i = 0; i < trials.size(); ++i) trials[i].index = i;
  return trials;
}

}  // namespace weft::recipes
