#pragma once
// How finely a campaign is simulated, why, and how far that is from a finer simulation of itself.

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "daemon/hardware/rig/rig_file.hpp"
#include "daemon/storage/certificate/promise.hpp"
#include "recipes/engine/plan.hpp"
#include "sim/devices/replay.hpp"

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

/// Of the normal force, and where it was.
struct ForceError {
  double force_n = 0;
  std::string fabric{}, exploration{}, phase{};
  double at_s = 0;
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
  /// The largest of those trials whose references agree well enough to say, whatever others leave
  /// open; 0: of none.
  ForceError resolved{};

  [[nodiscard]] ForceError largest() const {
    return {worst.force_max_n, worst_fabric, worst_exploration, worst_phase, worst_at_s};
  }
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
  [[nodiscard]] bool has_request() const { return promise.has_value() || budget.has_value(); }
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

/// Fills the promise of `note` from its errors; unless those are of every pair it is not held. An
/// error that is known to be above what was asked for stands for the largest, which may be open.
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

}  // namespace weft::daemon
