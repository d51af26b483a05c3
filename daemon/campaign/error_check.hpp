#pragma once
// Error of a campaign's simulation against a finer one, found by replaying some of its trials.

#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "daemon/campaign/simulation.hpp"
#include "daemon/campaign/trial_recording.hpp"
#include "recipes/engine/plan.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/devices/replay.hpp"
#include "sim/rig/rig.hpp"

namespace weft::daemon {

/// Adds the errors of some trials to `total`: largest differences, and root mean squares over all
/// samples. `total` is resolved only if all are. The largest resolved error is stored separately.
void merge(const SimulationError& one, SimulationError& total);

/// Stores the stages' motion in the first complete trial of every exploration and of every fabric.
/// Simulates those trials again at a finer setting when the campaign is over. With a requested
/// accuracy it stores one trial of every pair of the two and simulates two references. Does not
/// change the run. Cost: 1.5 MB per minute of a stored trial, then the time to simulate its
/// contact. For 30 s of motion that is about 20 ms for the quick reference and 0.2 s for each fine
/// one.
class ErrorCheck {
 public:
  static constexpr std::size_t most_trials = 64;
  struct StoredTrial {
    std::size_t trial;
    sim::BenchMotion motion;
    sim::SampleTimes sampled;
    std::vector<PhaseStart> phases;
  };

  /// Null `rig`: nothing is stored. `rig` and `plan` outlive it. `accuracy_n`: the requested
  /// accuracy.
  ErrorCheck(sim::Rig* rig, const recipes::Plan& plan, std::optional<double> accuracy_n)
      : rig_(rig), plan_(&plan), accuracy_n_(accuracy_n), pairs_(count_pairs(plan)) {}

  /// Call before every mount.
  void patch_follows();
  /// Call after each trial. The error is computed at the recorded samples of taxels and force.
  /// Without taxels: at the ends of the frames during the recording.
  void trial_done(std::size_t trial, bool complete, TimePoint now, const TrialRecording& recording);
  /// One error. None if no trial was stored and `before` is empty. `before`: errors from an earlier
  /// process of the campaign, of trials that this one has not run.
  [[nodiscard]] std::vector<SimulationError> errors(std::vector<SimulationError> before = {}) const;
  [[nodiscard]] const std::vector<StoredTrial>& trials() const { return trials_; }

 private:
  [[nodiscard]] SimulationError error_of(const StoredTrial& stored) const;
  using Pair = std::pair<std::size_t, std::size_t>;  ///< fabric, exploration
  [[nodiscard]] bool has_fabric(std::size_t fabric) const;
  [[nodiscard]] bool has_exploration(std::size_t exploration) const;
  [[nodiscard]] bool has_all() const;
  [[nodiscard]] bool is_wanted(const recipes::TrialSpec& spec) const;

  sim::Rig* rig_;
  const recipes::Plan* plan_;
  std::optional<double> accuracy_n_;
  std::size_t pairs_;
  std::set<Pair> seen_;  ///< of the stored trials
  std::vector<StoredTrial> trials_;
};

}  // namespace weft::daemon
