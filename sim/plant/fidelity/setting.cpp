#include "sim/plant/fidelity/setting.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

namespace weft::sim {

namespace {

constexpr double reference_l2_step_s = 0.2e-3;  // sim.md 5: L2 at 0.2 ms and at 50 us are one
constexpr double finer_share = 0.25;

std::string milliseconds(double seconds) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g ms", seconds * 1e3);
  return text.data();
}

}  // namespace

std::string_view to_string(Integrator integrator) {
  switch (integrator) {
    case Integrator::midpoint:
      return "midpoint";
    case Integrator::tr_bdf2:
      return "tr_bdf2";
    default:
      return "adaptive";
  }
}

Result<Integrator> integrator_from(std::string_view name) {
  for (const Integrator integrator :
       {Integrator::midpoint, Integrator::tr_bdf2, Integrator::adaptive})
    if (name == to_string(integrator)) return integrator;
  return fail(Errc::invalid_argument, "no such integrator", {}, "midpoint, tr_bdf2 or adaptive",
              std::string(name));
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
