#pragma once
// How finely a bench is simulated: level, integrator and step. Everything else about a rig says
// what is simulated.

#include <string>
#include <vector>

#include "sim/plant/plant.hpp"

namespace weft::sim {

/// The pads' conversion times are the plant's grid: it moves at most this far at once, but at L1,
/// whose balance may span the conversions of a scan.
constexpr double grid_step_s = 1e-9 * static_cast<double>(pad_timing::stage_ns);

struct FidelitySetting {
  Level level = Level::quasistatic;
  Integrator integrator = Integrator::midpoint;  ///< from L2 on
  double step_s = 0;                             ///< from L1 on, at most; 0: the plant's grid

  friend bool operator==(const FidelitySetting&, const FidelitySetting&) = default;
};

/// "L0", "L1 3.072 ms", "L2 adaptive 0.192 ms".
std::string to_string(const FidelitySetting& setting);
std::string_view to_string(Integrator integrator);
/// Errors: invalid_argument.
Result<Integrator> integrator_from(std::string_view name);

FidelitySetting setting_of(const PlantParams& params);
void apply(const FidelitySetting& setting, PlantParams& params);

/// What a run at `setting` is compared with: the same equations with a quarter of the step and,
/// from below L2, the next level up. Of L0, which has no step, the next level alone.
std::vector<FidelitySetting> finer_than(const FidelitySetting& setting);

}  // namespace weft::sim
