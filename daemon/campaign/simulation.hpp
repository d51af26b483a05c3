#pragma once
// Fidelity of a campaign's simulation: its setting, the reason, and its error against a finer one.

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
  std::optional<double> accuracy_n{};       ///< largest accepted error of the recorded force
  std::optional<double> times_real_time{};  ///< least speed of the whole run
  bool strict = false;                      ///< after a miss, run with the next setting
  std::optional<double> promise_below_n{};  ///< of a strict run after its first attempt
  std::optional<double> probe_us{};  ///< this machine's speed; none: measured, once per process
  bool is_evaluated = true;          ///< evaluation counts as part of the run
  bool is_checked = true;            ///< the error check counts as part of the run

  [[nodiscard]] bool uses_table() const {
    return accuracy_n.has_value() || times_real_time.has_value();
  }
};

/// Error of the normal force, with its place.
struct ForceError {
  double force_n = 0;
  std::string fabric{}, exploration{}, phase{};
  double at_s = 0;
};

/// Error of a campaign's recorded trials against a finer simulation.
struct SimulationError {
  sim::RunError worst;  ///< largest differences of all trials, root mean squares over all samples
  std::string worst_fabric;  ///< with the largest force difference
  std::size_t trials = 0;    ///< number of compared trials
  std::string worst_exploration{}, worst_phase{};
  double worst_at_s = 0;  ///< since the trial's phase S began
  /// Fabric and exploration of the trials with compared samples.
  std::set<std::pair<std::string, std::string>> pairs{};
  /// The largest among trials with references that agree well enough; other trials may be
  /// unresolved. 0: no such trial.
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
  std::vector<SimulationError> errors;  ///< empty if not requested, or if no trial is complete
  std::optional<SimulationPromise> promise{};  ///< with a requested accuracy
  std::optional<SimulationBudget> budget{};    ///< with a requested speed
  std::vector<std::string> aside{};            ///< folders of a strict run's previous attempts

  [[nodiscard]] bool empty() const { return setting.empty(); }
  [[nodiscard]] bool has_request() const { return promise.has_value() || budget.has_value(); }
};

/// Simulation records of a campaign that is resumed.
struct RecordedSimulation {
  std::string rig_json;
  SimulationNote note;
};

struct ChosenSimulation {
  SimulationNote note;
  std::string rig_text;  ///< with the choice written into it, as run and recorded
};

/// Chooses the simulation from the rig's sensors and traits, the recipe, and the fidelity table.
/// The rig file names the table (`simulation.fidelity`, relative to it). Reads it only if an
/// accuracy or speed is requested. On a bench that is not simulated by this process the note is
/// empty and the rig file unchanged. `recorded`: of a campaign that is resumed. Its original
/// request, setting, promise and reason stay, even if the table has changed; the note has the
/// errors found so far. Errors: those of sim::choose_simulation, with a place in the rig file;
/// unsupported if a request has no simulation here; wrong_state if the request differs from the
/// original one.
Result<ChosenSimulation> choose_simulation(const RigFile& rig,
                                           const std::filesystem::path& rig_path,
                                           const recipes::Plan& plan,
                                           const FidelityRequest& requested,
                                           const std::optional<RecordedSimulation>& recorded = {});

/// Fills the promise of `note` from its errors. It is kept only if the errors cover every pair. A
/// resolved error above the requested accuracy replaces the largest one, which may be unresolved.
void evaluate_promise(SimulationNote& note);
/// True if a resolved error is above the requested accuracy; false if it was not checked.
bool is_measured_miss(const SimulationPromise& promise);
/// True if an accuracy was requested and the run cannot show that it was kept.
bool is_promise_missed(const SimulationNote& note);

/// For the campaign's journal.
std::string to_json(const SimulationNote& note);
/// Inverse of to_json(). Errors: parse.
Result<SimulationNote> simulation_note_from(std::string_view json_text);

/// Pairs of fabric and exploration in the plan's trials.
std::size_t count_pairs(const recipes::Plan& plan);

}  // namespace weft::daemon
