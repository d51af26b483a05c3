#pragma once
// How finely a campaign is simulated, why, and how far that is from a finer simulation of itself.

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "daemon/hardware/rig/rig_file.hpp"
#include "recipes/engine/plan.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/devices/replay.hpp"
#include "sim/rig/rig.hpp"

namespace weft::daemon {

/// `--accuracy` and `--budget`.
struct FidelityRequest {
  std::optional<double> accuracy_n{};       ///< largest error of the force
  std::optional<double> times_real_time{};  ///< least speed of the plant
};

/// Of a campaign's recorded trials, against one finer setting.
struct SimulationError {
  sim::RunError worst;       ///< largest differences of all, root mean squares over all samples
  std::string worst_fabric;  ///< where the force differs most
  std::size_t trials = 0;    ///< that were looked at
};

/// Empty on a bench that is not simulated by this process.
struct SimulationNote {
  std::string setting;  ///< "L1 3.072 ms"
  std::string level;    ///< "L1"
  std::string because;  ///< "the scene needs a wrench, taxel counts and a regulated force"
  std::vector<SimulationError> errors;  ///< empty where it was not asked for, or no trial complete

  [[nodiscard]] bool empty() const { return setting.empty(); }
};

struct ChosenSimulation {
  SimulationNote note;
  std::string rig_text;  ///< with the choice written into it: what is run and recorded
};

/// On a bench that is not simulated by this process the note is empty and the rig file as it is.
/// From the rig's sensors and traits, what the recipe holds, and the table that the rig file names
/// (`simulation.fidelity`, relative to it), which is read only if something is asked for.
/// Errors: what sim::choose_simulation refuses, with a place in the rig file.
Result<ChosenSimulation> choose_simulation(const RigFile& rig,
                                           const std::filesystem::path& rig_path,
                                           const recipes::Plan& plan,
                                           const FidelityRequest& requested);

/// For the campaign's journal.
std::string to_json(const SimulationNote& note);
/// Back from there. Errors: parse.
Result<SimulationNote> simulation_note_from(std::string_view json_text);

// How far a campaign's simulation is from a finer one, found by playing some of its trials again.

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
