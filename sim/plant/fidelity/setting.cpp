#include "sim/plant/fidelity/setting.hpp"

#include <algorithm>

#include "protocols/base/names.hpp"
#include "sim/plant/bounds.hpp"

namespace weft::sim {
namespace {

constexpr NameTable<Integrator, 3> integrator_names = {{
    {Integrator::midpoint, "midpoint"},
    {Integrator::tr_bdf2, "tr_bdf2"},
    {Integrator::adaptive, "adaptive"},
}};

double step_or_grid_s(const FidelitySetting& setting) {
  return setting.step_s > 0 ? setting.step_s : grid_step_s;
}

}  // namespace

std::string_view to_string(Integrator integrator) {
  return name_in(integrator_names, integrator);
}

Result<Integrator> integrator_from(std::string_view name) {
  return value_from(integrator_names, name, "integrator unknown", "midpoint, tr_bdf2 or adaptive");
}

std::string to_string(const FidelitySetting& setting) {
  std::string text{to_string(setting.level)};
  if (setting.level < Level::quasistatic) return text;
  if (setting.level >= Level::dynamic) text += " " + std::string(to_string(setting.integrator));
  return text + printed(" %.4g ms", 1e3 * step_or_grid_s(setting));
}

FidelitySetting setting_of(const PlantParams& params) {
  if (params.level < Level::quasistatic) return {.level = params.level};
  if (params.level == Level::quasistatic)
    return {.level = params.level, .step_s = params.quasistatic_step_s};
  return {.level = params.level,
          .integrator = params.dynamics.integrator,
          .step_s = std::min(params.dynamics.step_s, grid_step_s)};
}

void apply(const FidelitySetting& setting, PlantParams& params) {
  params.level = setting.level;
  params.quasistatic_step_s = params.dynamics.step_s = step_or_grid_s(setting);
  params.dynamics.integrator = setting.integrator;
}

bool fits_bench(const FidelitySetting& setting) {
  constexpr double rounding = 1e-9;
  return setting.level <= Level::quasistatic || setting.step_s <= grid_step_s * (1 + rounding);
}

}  // namespace weft::sim
