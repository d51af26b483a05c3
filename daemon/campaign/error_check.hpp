#pragma once
// How far a campaign's simulation is from a finer one, found by playing some of its trials again.

#include <set>
#include <vector>

#include "daemon/campaign/simulation.hpp"
#include "recipes/engine/plan.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/rig/rig.hpp"

namespace weft::daemon {

/// Keeps the stages' motion in the first complete trial of every exploration and of every fabric,
/// and simulates those again more finely when the campaign is over. Changes nothing about a run.
/// Cost: 1.5 MB a minute of a kept trial, and then the time of simulating it three to five times
/// without drivers.
class ErrorCheck {
 public:
  static constexpr std::size_t most_trials = 64;

  /// Null: nothing is kept. `rig` and `plan` outlive it.
  ErrorCheck(sim::Rig* rig, const recipes::Plan& plan) : rig_(rig), plan_(&plan) {}

  /// Before every mount.
  void patch_follows();
  /// `sampled`: when the taxel samples that were recorded arrived; the others do not count.
  void trial_done(std::size_t trial, bool complete, TimePoint now,
                  const std::vector<TimePoint>& sampled);
  /// One for each finer setting; empty when no trial was kept.
  [[nodiscard]] std::vector<SimulationError> errors() const;

 private:
  struct StoredTrial {
    std::size_t trial;
    sim::BenchMotion motion;
    std::vector<TimePoint> sampled;
  };
  sim::Rig* rig_;
  const recipes::Plan* plan_;
  std::set<std::size_t> fabrics_, explorations_;  ///< of the kept trials
  std::vector<StoredTrial> trials_;
};

}  // namespace weft::daemon
