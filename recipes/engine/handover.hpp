#pragma once
// Handover of a complete campaign, as the recipe states it: training and evaluation.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "recipes/schema/object_reader.hpp"

namespace weft::recipes {

/// Source of the training data.
enum class HandoverSource : std::uint8_t {
  taxels,     ///< taxels and force: a model of all trials of each exploration, and its evaluation
  vibration,  ///< sound and acceleration of phase M: an evaluation without a model
  imprints    ///< the last scan of phase P of presses: Ellis' experiments, and a model
};
std::string_view to_string(HandoverSource from);

/// A complete data set is trained and evaluated automatically. Each test trial is evaluated by
/// models that were trained without it.
struct Handover {
  std::string learner = "best";  ///< one of handover_learners(from)
  /// Number of groups of repetitions. Each group is held out of the training once, with every
  /// fabric's trials, and tested.
  std::uint32_t groups = 5;
  double at_most_s = 3600;  ///< wall time; a longer handover has failed
  HandoverSource from = HandoverSource::taxels;
  bool by_default = false;  ///< the recipe does not state a handover
  friend bool operator==(const Handover&, const Handover&) = default;
};

/// Names that `weft fabric train --learner` accepts. Vibration adds "best", chosen on training
/// windows alone, and "every": the paper's ten, ours, and best. For imprints "every" means all
/// rules.
const std::vector<std::string_view>& handover_learners(HandoverSource from);

/// Reads the recipe's "hand_over", if present and not `false`. Errors: collected in `problems`:
/// fewer than two fabrics, fewer than two repetitions left to train on, a learner of another
/// source, and vibration on a rig without a vibration sensor (`has_vibration`).
/// Imprints are held out one by one and by object. For them groups are refused and one repetition
/// is enough.
std::optional<Handover> read_handover(ObjectReader& recipe, std::size_t fabrics,
                                      std::uint32_t repetitions, bool has_vibration,
                                      Problems& problems);

/// Adds the problems that prevent training from taxels or vibration; see read_handover().
void check_left_to_train(const Handover& handover, const std::string& place, std::size_t fabrics,
                         std::uint32_t repetitions, Problems& problems);

/// Deals repetitions 1 to `repetitions` into `groups` runs of nearly equal length. Returns the
/// group of each, from 0. Neighbours stay together, so that slow drift during a campaign is not in
/// both training and test part. With fewer repetitions than groups each is a group of its own.
std::vector<std::size_t> repetition_groups(std::uint32_t repetitions, std::uint32_t groups);

}  // namespace weft::recipes
