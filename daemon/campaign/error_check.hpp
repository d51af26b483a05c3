#pragma once
// How far a campaign's simulation is from a finer one, found by playing some of its trials again.

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

/// Adds what some trials showed to `total`: largest differences, and root mean squares over all
/// samples. `total` is resolved only where all are; the largest error that is known stays apart.
void merge(const SimulationError& one, SimulationError& total);

/// Keeps the stages' motion in the first complete trial of every exploration and of every fabric,
/// and simulates those again more finely when the campaign is over. Where an accuracy was asked for
/// it keeps one of every pair of the two and plays two references. Changes nothing about a run.
/// Cost: 1.5 MB a minute of a kept trial, and then the time of simulating its contact: some 20 ms
/// of the quick reference, 0.2 s of each fine one for 30 s of motion.
class ErrorCheck {
 public:
  static constexpr std::size_t most_trials = 64;
  struct StoredTrial {
    std::size_t trial;
    sim::BenchMotion motion;
    sim::SampleTimes sampled;
    std::vector<PhaseStart> phases;
  };

  /// Null: nothing is kept. `rig` and `plan` outlive it. `accuracy_n`: asked for.
  ErrorCheck(sim::Rig* rig, const recipes::Plan& plan, std::optional<double> accuracy_n)
      : rig_(rig), plan_(&plan), accuracy_n_(accuracy_n), pairs_(count_pairs(plan)) {}

  /// Before every mount.
  void patch_follows();
  /// Of the recording the samples of taxels and force count, without taxels the frames while it was
  /// recorded.
  void trial_done(std::size_t trial, bool complete, TimePoint now, const TrialRecording& recording);
  /// One, or none when no trial was kept and none was looked at `before`: by an earlier process of
  /// the campaign, in trials that this one has not run.
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
  std::set<Pair> seen_;  ///< of the kept trials
  std::vector<StoredTrial> trials_;
};

}  // namespace weft::daemon
