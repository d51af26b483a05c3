#pragma once
// Fidelity of a bench's simulation: level, integrator and step.

#include <string>
#include <string_view>

#include "sim/plant/plant.hpp"

namespace weft::sim {

/// The pads' conversion times are the plant's grid, and a step is at most this long. Exception: at
/// L1 a balance may span the conversions of a scan.
constexpr double grid_step_s = 1e-9 * static_cast<double>(pad_timing::stage_ns);

/// Only the fidelity; the other parameters of a rig define the simulated system.
struct FidelitySetting {
  Level level = Level::quasistatic;
  Integrator integrator = Integrator::midpoint;  ///< from L2 on
  double step_s = 0;                             ///< from L1 on, upper limit; 0: the plant's grid

  friend bool operator==(const FidelitySetting&, const FidelitySetting&) = default;
};

/// "L0", "L1 3.072 ms", "L2 adaptive 0.192 ms".
std::string to_string(const FidelitySetting& setting);
std::string_view to_string(Integrator integrator);
/// Errors: invalid_argument.
Result<Integrator> integrator_from(std::string_view name);

FidelitySetting setting_of(const PlantParams& params);
void apply(const FidelitySetting& setting, PlantParams& params);

/// Whether a bench can run it: its steps must end on the plant's grid; longer ones do not.
bool fits_bench(const FidelitySetting& setting);

}  // namespace weft::sim
