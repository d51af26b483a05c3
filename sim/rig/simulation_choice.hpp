#pragma once
// Chooses the fidelity of a campaign's simulation and gives the reason: from the scene, or from a
// requested accuracy and speed.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/plant/fidelity/choose.hpp"

namespace weft::sim {

/// Requests of a campaign to the bench, in addition to its rig file.
struct SimulationRequest {
  /// Traits of the recipe. They select the level if the rig file leaves it open. Unlike
  /// `simulation.traits`, they do not cause an error for a named level.
  std::vector<Trait> traits;
  /// Set points of the recipe. Level L0 has one set point and receives it.
  std::vector<double> set_points_n;
  /// Requested speed and accuracy. Its `level` and `run.has_pads` come from the rig file.
  FidelityRequest fidelity{};
  /// Setting of a resumed campaign, with its reason: it is used even if the table has changed.
  std::optional<FidelitySetting> recorded{};
  std::string recorded_because{};
  // From the recipe, for the promise of the table.
  std::vector<std::string> fabrics{};
  MeasuredRange speed_mps{};  ///< speeds of its strokes
  MeasuredRange press_s{};    ///< durations of its phases P
  double seat_speed_mps = 0;
  const FabricLibrary* library = nullptr;
  bool has_rows = true;  ///< see ForceScene

  [[nodiscard]] bool uses_table() const {
    return fidelity.accuracy_n.has_value() || fidelity.times_real_time.has_value();
  }
};

struct SimulationChoice {
  FidelitySetting setting;
  std::string because;  ///< "the scene needs a wrench, taxel counts and a regulated force"
  /// The rig file with the choice written into `simulation`, if anything was chosen: level, step
  /// and integrator, and `chosen` with the reason. It repeats the same run with any later table or
  /// rule.
  std::string rig_json;
  std::optional<FidelityOffer> offer{};  ///< of the table, if it was used
  std::optional<FidelityOffer>
      next{};  ///< the fastest one that promises a smaller error than `offer`
};

/// `table` may be null if neither accuracy nor speed is requested, or if the setting is recorded.
/// Pure. Errors: those of parse_rig_config and choose, each with a place in the rig file;
/// unsupported for L0 and a recipe with several set points.
Result<SimulationChoice> choose_simulation(std::string_view rig_json,
                                           const SimulationRequest& request,
                                           const FidelityTable* table);

}  // namespace weft::sim
