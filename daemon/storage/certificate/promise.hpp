#pragma once
// Accuracy and speed requested of a simulated campaign (`--accuracy`, `--budget`), and what was
// achieved.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace weft::daemon {

/// Largest error of the recorded normal force [N]; infinite if a force was not a number (null in
/// JSON).
struct SimulationPromise {
  double requested_n = 0;
  double promised_n = 0;    ///< from the table, for the setting that ran
  bool has_run = false;     ///< the campaign is over; true if read from a record
  bool is_checked = false;  ///< some complete trials were compared with references
  /// Pairs of fabric and exploration: `pairs` in the plan, `checked_pairs` with a compared trial.
  /// Motion that was not recorded cannot be checked: before a resume without replay, in slides that
  /// ended early, and beyond ErrorCheck::most_trials.
  std::size_t checked_pairs = 0, pairs = 0;
  // Results of the check.
  double measured_n = 0;     ///< largest error; if some pairs certainly miss the request, the
                             ///< largest of those
  double uncertainty_n = 0;  ///< largest difference of the two references
  bool is_resolved = true;   ///< false: the two references agree too badly for a decision
  bool held = false;         ///< all pairs checked and resolved, and measured_n at most requested_n
  /// Where measured_n occurred; phase "S", "P", "M" or "E".
  std::string fabric{}, exploration{}, phase{};
  double at_s = 0;  ///< time since the start of the trial's phase S
  // The fastest setting that promises a smaller error.
  std::string next_setting{};  ///< empty if there is none
  double next_promise_n = 0;
  bool operator==(const SimulationPromise&) const = default;
};

/// Speed in multiples of real time, from bring-up to the end of the error check. Export and
/// evaluation are excluded: they follow after the record is closed.
struct SimulationBudget {
  double requested = 0;
  double forecast = 0;
  double achieved = 0;            ///< in wall time; 0: not known
  double whole_run_forecast = 0;  ///< including export and evaluation, unlike the other members
  [[nodiscard]] bool is_missed() const { return achieved > 0 && achieved < requested; }
  bool operator==(const SimulationBudget&) const = default;
};

/// Layout in the certificate; only for campaigns with a requested accuracy or speed.
struct CertifiedSimulation {
  std::string setting;
  std::optional<SimulationPromise> promise;
  std::optional<SimulationBudget> budget;
  bool operator==(const CertifiedSimulation&) const = default;
};

void to_json(nlohmann::json& out, const SimulationPromise& promise);
void from_json(const nlohmann::json& object, SimulationPromise& promise);
void to_json(nlohmann::json& out, const SimulationBudget& budget);
void from_json(const nlohmann::json& object, SimulationBudget& budget);
void to_json(nlohmann::json& out, const CertifiedSimulation& simulation);
/// Also reads a journal entry of kind "simulation"; its other keys are ignored.
void from_json(const nlohmann::json& object, CertifiedSimulation& simulation);

}  // namespace weft::daemon
