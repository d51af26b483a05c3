#pragma once
// What a simulated campaign was asked to keep (`--accuracy`, `--budget`), and what it did.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace weft::daemon {

/// Largest error of the recorded normal force [N]; infinite where a force was no number, which is
/// null in JSON.
struct SimulationPromise {
  double requested_n = 0;
  double promised_n = 0;    ///< by the table, for the setting that ran
  bool has_run = false;     ///< the campaign is over; true where it was read from a record
  bool is_checked = false;  ///< some complete trials were compared with references
  /// Pairs of fabric and exploration: those of the plan, and those of which a trial was compared.
  /// Fewer are checked where motion was not recorded: before a resume that does not play the past
  /// again, of slides that ended early, beyond ErrorCheck::most_trials.
  std::size_t checked_pairs = 0, pairs = 0;
  // Of the check.
  double measured_n = 0;     ///< the largest; where some are known to miss, the largest of those
  double uncertainty_n = 0;  ///< largest difference of the two references
  bool is_resolved = true;   ///< false: the references do not agree well enough to say
  bool held = false;  ///< every pair checked, all resolved, and measured_n at most requested_n
  /// Of measured_n; phase "S", "P", "M" or "E".
  std::string fabric{}, exploration{}, phase{};
  double at_s = 0;  ///< since the trial's phase S began
  // The fastest setting that promises less.
  std::string next_setting{};  ///< empty: there is none
  double next_promise_n = 0;
  bool operator==(const SimulationPromise&) const = default;
};

/// In times real time, from bring-up to the end of the error check: export and evaluation come
/// after the record is closed.
struct SimulationBudget {
  double requested = 0;
  double forecast = 0;
  double achieved = 0;            ///< wall time; 0: not known
  double whole_run_forecast = 0;  ///< with export and evaluation, which the others leave out
  [[nodiscard]] bool is_missed() const { return achieved > 0 && achieved < requested; }
  bool operator==(const SimulationBudget&) const = default;
};

/// As the certificate has it; only for campaigns of which one of the two was asked.
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
/// Reads a journal entry of kind "simulation" as well, whose other keys are passed over.
void from_json(const nlohmann::json& object, CertifiedSimulation& simulation);

}  // namespace weft::daemon
