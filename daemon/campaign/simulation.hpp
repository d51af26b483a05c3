#pragma once
// How finely a campaign is simulated, why, and how far that is from a finer simulation of itself.

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "daemon/campaign/trial_recording.hpp"
#include "daemon/hardware/rig/rig_file.hpp"
#include "daemon/storage/certificate/promise.hpp"
#include "recipes/engine/plan.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/devices/replay.hpp"
#include "sim/rig/rig.hpp"

namespace weft::daemon {

/// `--accuracy` and `--budget`.
struct FidelityRequest {
  std::optional<double> accuracy_n{};       ///< largest error of the recorded force
  std::optional<double> times_real_time{};  ///< least speed of the whole run
  bool strict = false;                      ///< after a miss the next setting is run
  std::optional<double> promise_below_n{};  ///< of a strict run after its first attempt
  std::optional<double> probe_us{};  ///< this machine's speed; none: measured, once per process
  bool is_evaluated = true;          ///< evaluation counts as a part of the run
  bool is_checked = true;            ///< so does the error check

  [[nodiscard]] bool uses_table() const {
    return accuracy_n.has_value() || times_real_time.has_value();
  }
};

/// Of a campaign's recorded trials, against a finer simulation.
struct SimulationError {
  sim::RunError worst;       ///< largest differences of all, root mean squares over all samples
  std::string worst_fabric;  ///< where the force differs most
  std::size_t trials = 0;    ///< that were looked at
  std::string worst_exploration{}, worst_phase{};
  double worst_at_s = 0;  ///< since that trial's phase S began
  /// Fabric and exploration of those in which samples were compared.
  std::set<std::pair<std::string, std::string>> pairs{};
};

/// Empty on a bench that is not simulated by this process.
struct SimulationNote {
  std::string setting;  ///< "L1 3.072 ms"
  std::string level;    ///< "L1"
  std::string because;  ///< "the scene needs a wrench, taxel counts and a regulated force"
  std::vector<SimulationError> errors;  ///< empty where it was not asked for, or no trial complete
  std::optional<SimulationPromise> promise{};  ///< where an accuracy was asked for
  std::optional<SimulationBudget> budget{};    ///< where a speed was
  std::vector<std::string> aside{};  ///< folders of a strict run's attempts before this one

  [[nodiscard]] bool empty() const { return setting.empty(); }
  [[nodiscard]] bool is_asked() const { return promise.has_value() || budget.has_value(); }
};

/// What the file of a campaign that goes on says.
struct RecordedSimulation {
  std::string rig_json;
  SimulationNote note;
};

struct ChosenSimulation {
  SimulationNote note;
  std::string rig_text;  ///< with the choice written into it: what is run and recorded
};

/// On a bench that is not simulated by this process the note is empty and the rig file as it is.
/// From the rig's sensors and traits, what the recipe holds, and the table that the rig file names
/// (`simulation.fidelity`, relative to it), which is read only if something is asked for.
/// `recorded`: of a campaign that goes on. What was asked for at its begin stays, setting, promise
/// and reason too, whatever the table says by now; the note has the errors that were found so far.
/// Errors: what sim::choose_simulation refuses, with a place in the rig file; wrong_state, where
/// something else is asked for than at the begin.
Result<ChosenSimulation> choose_simulation(const RigFile& rig,
                                           const std::filesystem::path& rig_path,
                                           const recipes::Plan& plan,
                                           const FidelityRequest& requested,
                                           const std::optional<RecordedSimulation>& recorded = {});

/// Fills the promise of `note` from its errors; unless those are of every pair it is not held.
void evaluate_promise(SimulationNote& note);
/// Whether the error is known to be above what was asked for: not whether it was checked.
bool is_measured_miss(const SimulationPromise& promise);
/// Whether an accuracy was asked for and the run cannot say that it was kept.
bool is_promise_missed(const SimulationNote& note);

/// For the campaign's journal.
std::string to_json(const SimulationNote& note);
/// Back from there. Errors: parse.
Result<SimulationNote> simulation_note_from(std::string_view json_text);

/// Pairs of fabric and exploration in the plan's trials.
std::size_t count_pairs(const recipes::Plan& plan);

// How far a campaign's simulation is from a finer one, found by playing some of its trials again.

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
