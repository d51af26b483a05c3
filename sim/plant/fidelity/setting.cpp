#include "sim/plant/fidelity/setting.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "protocols/base/names.hpp"

namespace weft::sim {

namespace {

constexpr double reference_l2_step_s = 0.2e-3;  // docs/reference/plant.md, Levels
constexpr double finer_share = 0.25;
constexpr NameTable<Integrator, 3> integrator_names = {{
    {Integrator::midpoint, "midpoint"},
    {Integrator::tr_bdf2, "tr_bdf2"},
    {Integrator::adaptive, "adaptive"},
}};

std::string milliseconds(double seconds) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g ms", seconds * 1e3);
  return text.data();
}

}  // namespace

std::string_view to_string(Integrator integrator) {
  return name_in(integrator_names, integrator);
}

Result<Integrator> integrator_from(std::string_view name) {
  return value_from(integrator_names, name, "no such integrator", "midpoint, tr_bdf2 or adaptive");
}

std::string to_string(const FidelitySetting& setting) {
  std::string text{to_string(setting.level)};
  if (setting.level < Level::quasistatic) return text;
  if (setting.level >= Level::dynamic) text += " " + std::string(to_string(setting.integrator));
  return text + " " + milliseconds(setting.step_s > 0 ? setting.step_s : grid_step_s);
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
  const double step_s = setting.step_s > 0 ? setting.step_s : grid_step_s;
  params.quasistatic_step_s = step_s;
  params.dynamics.step_s = step_s;
  params.dynamics.integrator = setting.integrator;
}

std::vector<FidelitySetting> finer_than(const FidelitySetting& setting) {
  const double step_s = setting.step_s > 0 ? setting.step_s : grid_step_s;
  FidelitySetting quarter = setting;
  quarter.step_s = finer_share * step_s;
  const FidelitySetting dynamic{Level::dynamic, Integrator::midpoint, reference_l2_step_s};
  if (setting.level < Level::quasistatic)
    return {{.level = Level::quasistatic, .step_s = grid_step_s}};
  if (setting.level == Level::quasistatic) return {quarter, dynamic};
  return {quarter};
}

}  // namespace weft::sim
