#include "sim/plant/pads.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/plant/random.hpp"

namespace weft::sim {

namespace {

constexpr double vacuum_permittivity_f_m = 8.8541878128e-12;  // CODATA 2018
constexpr double level_pressure_pa = 1000;  // where the hysteresis starts to count by ratio [E]
constexpr double frame_s = static_cast<double>(pad_timing::frame_ns) * 1e-9;

}  // namespace

double air_gap_m(const PadParams& params, double pressure_pa, double gap_m) {
  return gap_m / (1 + pressure_pa / params.gap_pressure_pa);
}

double capacitance_f(const PadParams& params, double gap_m) {
  const double area_m2 = std::numbers::pi / 4 * params.diameter_m * params.diameter_m;
  return vacuum_permittivity_f_m * area_m2 /
         (params.dielectric_m / params.dielectric_permittivity + gap_m);
}

std::uint16_t quantise(double counts) {
  if (!(counts > 0)) return 0;
  return static_cast<std::uint16_t>(std::lround(std::min(counts, 65535.0)));
}

PadArray::PadArray(const PadParams& params, std::uint64_t sensor_seed)
    : params_(params),
      creep_keep_(std::exp(-frame_s / params.creep_time_s)),
      drift_keep_(std::exp(-frame_s / params.drift_time_s)),
      noise_seed_(sensor_seed) {
  Random random(mix(sensor_seed, "pads"));
  for (Pad& pad : pads_) {
    pad.gain = std::max(0.1, 1 + params_.gain_spread * random.gaussian());
    pad.gap_m = params_.gap_m * std::max(0.1, 1 + params_.gap_spread * random.gaussian());
    pad.baseline_counts = random.uniform(params_.baseline_low_counts, params_.baseline_high_counts);
    pad.idle_f = capacitance_f(params_, pad.gap_m);
  }
  for (std::size_t i = 0; i < pad_count; ++i) counts_[i] = quantise(pads_[i].baseline_counts);
}

void PadArray::reset(std::uint64_t noise_seed, double gain_scale) {
  noise_seed_ = noise_seed;
  gain_scale_ = gain_scale;
  Random random(mix(noise_seed, "drift"));
  for (Pad& pad : pads_) {
    pad.creep_pa = pad.level = pad.change_f = 0;
    pad.branch = -1;
    pad.drift_counts = params_.drift_counts * random.gaussian();
  }
}

/// Pressure as the gap feels it: creep added, the branch of the hysteresis taken off.
double PadArray::felt_pa(Pad& pad, double pressure_pa) const {
  pad.creep_pa = pressure_pa + (pad.creep_pa - pressure_pa) * creep_keep_;
  const double crept = pressure_pa + params_.creep * pad.creep_pa;
  if (!(params_.hysteresis > 0)) return crept;
  const double level = std::log1p(crept / level_pressure_pa);
  pad.branch = branch_after(pad.branch, pad.level, level, {params_.hysteresis});
  pad.level = level;
  // The gap lags: less closed while loading, more while unloading.
  return crept * branch_factor(-pad.branch, params_.hysteresis);
}

double PadArray::neighbours_f(std::size_t pad) const {
  const std::size_t column = pad % 4, row = pad / 4;
  double sum = 0;
  if (column > 0) sum += pads_[pad - 1].change_f;
  if (column < 3) sum += pads_[pad + 1].change_f;
  if (row > 0) sum += pads_[pad - 4].change_f;
  if (row < 3) sum += pads_[pad + 4].change_f;
  return sum;
}

void PadArray::convert(std::size_t index, double pressure_pa, std::uint64_t frame) {
  Pad& pad = pads_[index];
  const double gap_m = air_gap_m(params_, felt_pa(pad, pressure_pa), pad.gap_m);
  pad.change_f = capacitance_f(params_, gap_m) - pad.idle_f;
  Random random(mix(noise_seed_, frame * pad_count + index));
  const double spread = params_.drift_counts * std::sqrt(1 - drift_keep_ * drift_keep_);
  // One Box-Muller pair: the drift's kick and the conversion's noise.
  const double radius = std::sqrt(-2 * std::log(1 - random.uniform()));
  const double angle = random.angle();
  pad.drift_counts = drift_keep_ * pad.drift_counts + spread * radius * std::sin(angle);
  const double change_f = pad.change_f + params_.crosstalk * neighbours_f(index);
  counts_[index] = quantise(pad.baseline_counts + pad.drift_counts +
                            gain_scale_ * pad.gain * change_f / params_.lsb_f +
                            params_.noise_counts * radius * std::cos(angle));
}

}  // namespace weft::sim
