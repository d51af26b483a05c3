#include "sim/plant/pads.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/plant/bounds.hpp"
#include "sim/plant/lanes_math.hpp"
#include "sim/plant/random.hpp"

namespace weft::sim {

namespace {

constexpr double vacuum_permittivity_f_m = 8.8541878128e-12;  // CODATA 2018
constexpr double level_pressure_pa = 1000;  // where the hysteresis starts to count by ratio [E]
constexpr double largest_felt_pa = 1e15;    // closes any gap
constexpr double frame_s = static_cast<double>(pad_timing::frame_ns) * 1e-9;

/// Capacitance of a pad's plates times their distance in vacuum.
double plate_f_m(const PadParams& params) {
  return vacuum_permittivity_f_m * std::numbers::pi / 4 * params.diameter_m * params.diameter_m;
}

}  // namespace

Status check(const PadParams& params) {
  return check_bounds(
      "pads", {{"the pads' diameter in m", params.diameter_m, 1e-6, 1},
               {"the dielectric in m", params.dielectric_m, 1e-9, 1},
               {"the dielectric's permittivity", params.dielectric_permittivity, 1, 1e5},
               {"the gap in m", params.gap_m, 1e-12, 1},
               {"the pressure that halves the gap in Pa", params.gap_pressure_pa, 1e-3, 1e12},
               {"a count in F", params.lsb_f, 1e-21, 1},
               {"the lowest baseline in counts", params.baseline_low_counts, 0, 65535},
               {"the highest baseline in counts", params.baseline_high_counts,
                params.baseline_low_counts, 65535},
               {"the gains' spread", params.gain_spread, 0, 10},
               {"the gaps' spread", params.gap_spread, 0, 10},
               {"the crosstalk", params.crosstalk, 0, 1},
               {"the creep", params.creep, 0, 100},
               {"the creep's time in s", params.creep_time_s, 1e-6, 1e9},
               {"the hysteresis", params.hysteresis, 0, 0.999},
               {"the drift in counts", params.drift_counts, 0, 1e6},
               {"the drift's time in s", params.drift_time_s, 1e-6, 1e12},
               {"the noise in counts", params.noise_counts, 0, 1e6}});
}

double air_gap_m(const PadParams& params, double pressure_pa, double gap_m) {
  return gap_m / (1 + pressure_pa / params.gap_pressure_pa);
}

double capacitance_f(const PadParams& params, double gap_m) {
  return plate_f_m(params) / (params.dielectric_m / params.dielectric_permittivity + gap_m);
}

std::uint16_t quantise(double counts) {
  if (!(counts > 0)) return 0;
  return static_cast<std::uint16_t>(std::min(counts, 65535.0) + 0.5);
}

PadArray::Law PadArray::law_of(const PadParams& params) {
  const double drift_keep = std::exp(-frame_s / params.drift_time_s);
  return {.creep = params.creep,
          .creep_keep = std::exp(-frame_s / params.creep_time_s),
          .hysteresis = params.hysteresis,
          .per_hysteresis_length = 1 / Hysteresis{}.length,
          .area_f_m = plate_f_m(params),
          .dielectric_m = params.dielectric_m / params.dielectric_permittivity,
          .gap_pressure_pa = params.gap_pressure_pa,
          .drift_keep = drift_keep,
          .drift_kick_counts = params.drift_counts * std::sqrt(1 - drift_keep * drift_keep)};
}

PadArray::PadArray(const PadParams& params, std::uint64_t sensor_seed)
    : params_(params), law_(law_of(params)), noise_seed_(sensor_seed) {
  Random random(mix(sensor_seed, "pads"));
  for (std::size_t i = 0; i < pad_count; ++i) {
    sensor_.gain[i] = std::max(0.1, 1 + params_.gain_spread * random.gaussian());
    sensor_.gap_m[i] = params_.gap_m * std::max(0.1, 1 + params_.gap_spread * random.gaussian());
    sensor_.baseline_counts[i] =
        random.uniform(params_.baseline_low_counts, params_.baseline_high_counts);
    sensor_.idle_f[i] = capacitance_f(params_, sensor_.gap_m[i]);
    state_.branch[i] = -1;
    counts_[i] = quantise(sensor_.baseline_counts[i]);
  }
}

void PadArray::reset(std::uint64_t noise_seed, double gain_scale) {
  noise_seed_ = noise_seed;
  gain_scale_ = gain_scale;
  state_ = {};
  state_.branch.fill(-1);
  Random random(mix(noise_seed, "drift"));
  for (double& drift : state_.drift_counts) drift = params_.drift_counts * random.gaussian();
}

/// Pads [first, last), whole lanes. The pressure gets its creep, the branch of the hysteresis is
/// taken off (the gap lags: less closed while loading, more while unloading), the gap makes the
/// capacitance; one Box-Muller pair is the drift's kick and the conversion's noise.
WEFT_SIM_CLONES void PadArray::compute(const Law& law, const Sensor& sensor, const State& from,
                                       const Values& pressure_pa, const Values& draw,
                                       const Values& turns, std::size_t first, std::size_t last,
                                       State& to) {
  using simd::Lanes, simd::load, simd::store;
  for (std::size_t i = first; i < last; i += simd::width) {
    const Lanes asked = load(&pressure_pa[i]);
    const Lanes pressure = asked <= largest_felt_pa ? asked : simd::all(largest_felt_pa);
    const Lanes creep = pressure + (load(&from.creep_pa[i]) - pressure) * law.creep_keep;
    Lanes felt = pressure + law.creep * creep;
    store(&to.creep_pa[i], creep);
    Lanes level{}, branch = simd::all(-1);
    if (law.hysteresis > 0) {
      level = simd::log(1.0 + felt * (1 / level_pressure_pa));
      const Lanes moved = level - load(&from.level[i]);
      const Lanes target = moved > 0 ? simd::all(1) : simd::all(-1);
      const Lanes keep = simd::exp(-simd::abs(moved) * law.per_hysteresis_length);
      branch = target + (load(&from.branch[i]) - target) * keep;
      felt *= (1.0 - law.hysteresis * branch) * (1 / (1 + law.hysteresis));
    }
    store(&to.level[i], level);
    store(&to.branch[i], branch);
    felt = felt > largest_felt_pa ? simd::all(largest_felt_pa) : felt;
    // epsilon A/(d + g0 p_g/(p_g + p)) with one division.
    const Lanes closing = law.gap_pressure_pa + felt;
    const Lanes gap = load(&sensor.gap_m[i]) * law.gap_pressure_pa;
    store(&to.change_f[i],
          law.area_f_m * closing / (law.dielectric_m * closing + gap) - load(&sensor.idle_f[i]));
    const Lanes radius = simd::sqrt(-2.0 * simd::log(load(&draw[i])));
    const simd::Turned angle = simd::turned(load(&turns[i]));
    store(&to.drift_counts[i], law.drift_keep * load(&from.drift_counts[i]) +
                                   law.drift_kick_counts * radius * angle.sine);
    store(&to.noise[i], radius * angle.cosine);
  }
}

double PadArray::neighbours_f(std::size_t pad) const {
  const std::size_t column = pad % 4, row = pad / 4;
  double sum = 0;
  if (column > 0) sum += state_.change_f[pad - 1];
  if (column < 3) sum += state_.change_f[pad + 1];
  if (row > 0) sum += state_.change_f[pad - 4];
  if (row < 3) sum += state_.change_f[pad + 4];
  return sum;
}

/// Of each pad and frame on its own: drawing for one never shifts another.
void PadArray::draw_noise(std::uint64_t frame, std::size_t first, std::size_t last, Values& draw,
                          Values& turns) const {
  for (std::size_t i = first; i < last; ++i) {
    Random random(mix(noise_seed_, frame * pad_count + i));
    draw[i] = 1 - random.uniform();
    turns[i] = random.uniform();
  }
}

void PadArray::commit(std::size_t pad, const State& next) {
  state_.creep_pa[pad] = next.creep_pa[pad];
  state_.level[pad] = next.level[pad];
  state_.branch[pad] = next.branch[pad];
  state_.drift_counts[pad] = next.drift_counts[pad];
  state_.change_f[pad] = next.change_f[pad];
  const double change_f = next.change_f[pad] + params_.crosstalk * neighbours_f(pad);
  counts_[pad] = quantise(sensor_.baseline_counts[pad] + next.drift_counts[pad] +
                          gain_scale_ * sensor_.gain[pad] * change_f / params_.lsb_f +
                          params_.noise_counts * next.noise[pad]);
}

void PadArray::convert(std::size_t pad, double pressure_pa, std::uint64_t frame) {
  const std::size_t first = pad / simd::width * simd::width, last = first + simd::width;
  Values pressures{}, draw, turns;
  pressures[pad] = pressure_pa;
  draw_noise(frame, first, last, draw, turns);
  State next = state_;
  compute(law_, sensor_, state_, pressures, draw, turns, first, last, next);
  commit(pad, next);
}

void PadArray::convert_stages(const std::array<double, pad_count>& pressure_pa, std::uint64_t frame,
                              int first, int last) {
  Values draw, turns;
  draw_noise(frame, 0, pad_count, draw, turns);
  State next;
  compute(law_, sensor_, state_, pressure_pa, draw, turns, 0, pad_count, next);
  for (int stage = first; stage < last; ++stage)
    for (const int pad : {stage, stage + pad_timing::stages})
      commit(static_cast<std::size_t>(pad), next);
}

}  // namespace weft::sim
