#pragma once
// How finely a campaign is simulated, and why: from the scene, or from an accuracy and a speed that
// somebody asks for.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/plant/fidelity/choose.hpp"

namespace weft::sim {

/// What a campaign asks of the bench, beyond what its rig file says.
struct SimulationRequest {
  /// Of the recipe. They choose where the rig file leaves the level open; they are no reason to
  /// refuse a level that it names, as `simulation.traits` are.
  std::vector<Trait> traits;
  /// Forces that the recipe holds: level L0, which knows one set point, is given it.
  std::vector<double> set_points_n;
  /// What is asked of speed and accuracy. Its `level` and `run.has_pads` are the rig file's.
  FidelityRequest fidelity{};
  /// Of a campaign that goes on, with its reason: it is taken whatever a table says by now.
  std::optional<FidelitySetting> recorded{};
  std::string recorded_because{};
  // Of the recipe, for what the table promises.
  std::vector<std::string> fabrics{};
  MeasuredRange speed_mps{};  ///< of its slides
  MeasuredRange press_s{};    ///< lengths of its phases P
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
  /// The rig file with the choice written into `simulation`, where anything was chosen: it names
  /// level, step and integrator, and `chosen` says how they came about. Running it again makes the
  /// same run whatever table or rule there is by then.
  std::string rig_json;
  std::optional<FidelityOffer> offer{};  ///< of the table, where it was asked
  std::optional<FidelityOffer> next{};   ///< the fastest that promises less than `offer`
};

/// `table` may be null where neither accuracy nor speed is asked for, or the setting is recorded. A
/// function of its arguments. Errors: what parse_rig_config and choose refuse, each with a place in
/// the rig file; unsupported for L0 and a recipe that holds several forces.
Result<SimulationChoice> choose_simulation(std::string_view rig_json,
                                           const SimulationRequest& request,
                                           const FidelityTable* table);

}  // namespace weft::sim
