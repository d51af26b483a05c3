#pragma once
// What is learnt from a campaign once it is complete, as the recipe says.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "recipes/schema/object_reader.hpp"

namespace weft::recipes {

/// What a hand-over learns from.
enum class HandoverSource : std::uint8_t {
  taxels,     ///< and force: a model of all trials of each exploration, and its evaluation
  vibration,  ///< sound and acceleration of phase M: an evaluation, no model
  imprints    ///< the last scan of phase P of presses: Ellis' experiments, and a model
};
std::string_view to_string(HandoverSource from);

/// A complete data set goes to the classifier by itself, and is evaluated by models that were
/// trained without what they are asked about.
struct Handover {
  std::string learner = "best";  ///< one of handover_learners(from)
  /// The repetitions are dealt into so many groups; each is left out of the training once, with
  /// every fabric's trials, and asked about.
  std::uint32_t groups = 5;
  double at_most_s = 3600;  ///< wall time; longer, and the hand-over has failed
  HandoverSource from = HandoverSource::taxels;
  bool by_default = false;  ///< the recipe says nothing of it
  friend bool operator==(const Handover&, const Handover&) = default;
};

/// Names as `weft fabric train --learner` takes them; of vibration "best", chosen on training
/// windows alone, and "every": the paper's ten, ours, and best; of imprints "every" rule there is.
const std::vector<std::string_view>& handover_learners(HandoverSource from);

/// Reads the recipe's "hand_over", where it has one that is not `false`. A problem as well: fewer
/// than two fabrics, repetitions of which fewer than two would be left to train on, a learner of
/// another source, and vibration from a rig without a sensor of it (`has_vibration`). Imprints are
/// left out one by one and by object: there groups are refused and one repetition is enough.
std::optional<Handover> read_handover(ObjectReader& recipe, std::size_t fabrics,
                                      std::uint32_t repetitions, bool has_vibration,
                                      Problems& problems);

/// Adds what keeps a hand-over `from` taxels or vibration from learning: see read_handover().
void check_left_to_train(const Handover& handover, const std::string& place, std::size_t fabrics,
                         std::uint32_t repetitions, Problems& problems);

/// Repetitions 1 to `repetitions` in `groups` runs of equal length, give or take one: the group of
/// each, from 0. Neighbours stay together, so that what drifts in the course of a campaign is not
/// on both sides. With fewer repetitions than groups each is its own.
std::vector<std::size_t> repetition_groups(std::uint32_t repetitions, std::uint32_t groups);

}  // namespace weft::recipes
