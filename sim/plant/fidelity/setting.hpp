#pragma once
// How finely a bench is simulated: level, integrator and step.

#include <string>
#include <string_view>

#include "sim/plant/plant.hpp"

namespace weft::sim {

/// The pads' conversion times are the plant's grid: it moves at most this far at once, but at L1,
/// whose balance may span the conversions of a scan.
constexpr double grid_step_s = 1e-9 * static_cast<double>(pad_timing::stage_ns);

/// Everything else about a rig says what is simulated.
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

/// Whether a bench can run it: its steps end on the plant's grid, longer ones do not.
bool fits_bench(const FidelitySetting& setting);

}  // namespace weft::sim
