#pragma once
// How well the force was held in phase M, computed again from the recorded wrench.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/campaign/trial_recording.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// Set point of phase M of one exploration, from the recipe that was run.
struct ForceTarget {
  std::string exploration;
  double force_n = 0;
  double band_n = 0;
  Phase phase = Phase::motion;  ///< in which it is judged: P of a press
};

/// Empty when the data set carries no recipe and rig that can be read.
std::vector<ForceTarget> force_targets(const DatasetInfo& info);
std::optional<ForceTarget> find_target(const std::vector<ForceTarget>& targets,
                                       std::string_view exploration);

struct FabricForce {
  std::string fabric;
  std::size_t trials = 0;
  ForceTally tally;
};

/// Complete trials, by fabric in order of their first trial. Wrench samples between the first and
/// the last taxel sample of phase M, so up to one taxel period is left out at either end compared
/// with the run's own tally.
std::vector<FabricForce> force_by_fabric(const Dataset& dataset,
                                         const std::vector<ForceTarget>& targets);

}  // namespace weft::daemon
