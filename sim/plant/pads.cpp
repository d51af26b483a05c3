#include "sim/plant/pads.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocols/base/time.hpp"
#include "sim/plant/bounds.hpp"
#include "sim/plant/fabric_law.hpp"
#include "sim/plant/field_reader.hpp"
#include "sim/plant/lanes.hpp"
#include "sim/plant/random.hpp"

namespace weft::sim {

namespace {

constexpr double vacuum_permittivity_f_m = 8.8541878128e-12;  // CODATA 2018
constexpr double level_pressure_pa = 1000;  // hysteresis is by ratio above, by difference below [E]
constexpr double largest_felt_pa = 1e15;    // closes any gap
constexpr double frame_s = static_cast<double>(pad_timing::frame_ns) * 1e-9;

/// Capacitance of a pad's plates times their distance, in vacuum.
double plate_f_m(const PadParams& params) {
  return vacuum_permittivity_f_m * std::numbers::pi / 4 * params.diameter_m * params.diameter_m;
}

/// Four counts.
using Whole = std::int32_t __attribute__((vector_size(simd::width * sizeof(std::int32_t))));

/// A number in (-1, 1) from the bits that Random::uniform_of does not use. It is the middle of its
/// step, so that kicks have mean zero: a slow drift would accumulate a mean.
double kick_of(std::uint64_t bits) {
  constexpr std::int64_t steps = 1 << 11;
  return static_cast<double>(2 * static_cast<std::int64_t>(bits & (steps - 1)) - (steps - 1)) *
         (1.0 / steps);
}

/// One frame of an Ornstein-Uhlenbeck process.
struct Wander {
  double retained, kick;
};
Wander wander_of(double deviation, double time_s) {
  const double retained = std::exp(-frame_s / time_s);
  return {retained, deviation * std::sqrt(1 - retained * retained)};
}

}  // namespace

Status check(const PadParams& params) {
  return check_bounds("pads",
                      {{"pad diameter [m]", params.diameter_m, 1e-6, 1},
                       {"dielectric [m]", params.dielectric_m, 1e-9, 1},
                       {"dielectric permittivity", params.dielectric_permittivity, 1, 1e5},
                       {"gap [m]", params.gap_m, 1e-12, 1},
                       {"pressure that halves the gap [Pa]", params.gap_pressure_pa, 1e-3, 1e12},
                       {"count [F]", params.lsb_f, 1e-21, 1},
                       {"lowest baseline [counts]", params.baseline_low_counts, 0, 65535},
                       {"highest baseline [counts]", params.baseline_high_counts,
                        params.baseline_low_counts, 65535},
                       {"gain spread", params.gain_spread, 0, 10},
                       {"gap spread", params.gap_spread, 0, 10},
                       {"crosstalk", params.crosstalk, 0, 1},
                       {"creep", params.creep, 0, 100},
                       {"creep time [s]", params.creep_time_s, 1e-6, 1e9},
                       {"hysteresis", params.hysteresis, 0, 0.999},
                       {"drift [counts]", params.drift_counts, 0, 1e6},
                       {"drift time [s]", params.drift_time_s, 1e-6, 1e12},
                       {"noise [counts]", params.noise_counts, 0, 1e6},
                       {"noise per count", params.noise_per_count, 0, 1e6},
                       {"noise per square", params.noise_per_square, 0, 1e3},
                       {"common mode", params.common_mode, 0, 1},
                       {"common mode time [s]", params.common_mode_time_s, 1e-6, 1e9},
                       {"temperature spread [K]", params.temperature_k, 0, 1e3},
                       {"temperature time [s]", params.temperature_time_s, 1e-6, 1e12},
                       {"gain per K", params.gain_per_k, -1, 1},
                       {"pad height [m]", params.height_spread_m, 0, 1}});
}

Status read_pads(FieldReader& reader, PadParams& pads) {
  reader.number("gap_um", pads.gap_m, 0.1, 1000, m_per_um);
  reader.number("gap_pressure_Pa", pads.gap_pressure_pa, 10, 1e7);
  reader.number("gain_spread", pads.gain_spread, 0, 2);
  reader.number("gap_spread", pads.gap_spread, 0, 0.5);
  reader.number("crosstalk", pads.crosstalk, 0, 0.25);
  reader.number("creep", pads.creep, 0, 1);
  reader.number("creep_time_s", pads.creep_time_s, 0.01, 1e5);
  reader.number("hysteresis", pads.hysteresis, 0, 0.5);
  reader.number("drift_counts", pads.drift_counts, 0, 1e4);
  reader.number("drift_time_s", pads.drift_time_s, 0.01, 1e7);
  reader.number("noise_counts", pads.noise_counts, 0, 1e4);
  reader.number("noise_per_count", pads.noise_per_count, 0, 1e4);
  reader.number("noise_per_square", pads.noise_per_square, 0, 1);
  reader.number("common_mode", pads.common_mode, 0, 0.5);
  reader.number("common_mode_time_s", pads.common_mode_time_s, 0.01, 1e7);
  reader.number("temperature_K", pads.temperature_k, 0, 50);
  reader.number("temperature_time_s", pads.temperature_time_s, 0.01, 1e7);
  reader.number("gain_per_K", pads.gain_per_k, -0.1, 0.1);
  reader.number("height_spread_um", pads.height_spread_m, 0, 500, m_per_um);
  return reader.finish();
}

double capacitance_f(const PadParams& params, double gap_m) {
  return plate_f_m(params) / (params.dielectric_m / params.dielectric_permittivity + gap_m);
}

std::uint16_t quantise(double counts) {
  if (!(counts > 0)) return 0;
  return static_cast<std::uint16_t>(std::min(counts, 65535.0) + 0.5);
}

PadArray::Law PadArray::law_of(const PadParams& params) {
  const double drift_retained = std::exp(-frame_s / params.drift_time_s);
  // A kick is even in (-1, 1) with variance 1/3; the sum of thousands is a normal drift.
  const double kick_counts =
      params.drift_counts * std::sqrt(3 * (1 - drift_retained * drift_retained));
  const Wander common = wander_of(params.common_mode, params.common_mode_time_s),
               temperature = wander_of(params.temperature_k, params.temperature_time_s);
  return {.creep = params.creep,
          .creep_retained = std::exp(-frame_s / params.creep_time_s),
          .hysteresis = params.hysteresis,
          .per_hysteresis_length = 1 / Hysteresis{}.length,
          .area_f_m = plate_f_m(params),
          .dielectric_m = params.dielectric_m / params.dielectric_permittivity,
          .gap_pressure_pa = params.gap_pressure_pa,
          .drift_retained = drift_retained,
          .drift_kick_counts = kick_counts,
          .crosstalk = params.crosstalk,
          .noise_counts = params.noise_counts,
          .noise_per_count = params.noise_per_count,
          .noise_per_square = params.noise_per_square,
          .common_retained = common.retained,
          .common_kick = common.kick,
          .temperature_retained = temperature.retained,
          .temperature_kick_k = temperature.kick,
          .gain_per_k = params.gain_per_k};
}

PadArray::PadArray(const PadParams& params, std::uint64_t sensor_seed)
    : params_(params), law_(law_of(params)), noise_seed_(sensor_seed) {
  Random random(mix(sensor_seed, "pads"));
  for (std::size_t i = 0; i < pad_count; ++i) {
    gain_[i] = std::exp(params_.gain_spread * random.gaussian());
    sensor_.counts_per_f[i] = gain_[i] / params_.lsb_f;
    sensor_.gap_m[i] = params_.gap_m * std::max(0.1, 1 + params_.gap_spread * random.gaussian());
    sensor_.baseline_counts[i] =
        random.uniform(params_.baseline_low_counts, params_.baseline_high_counts);
    sensor_.idle_f[i] = capacitance_f(params_, sensor_.gap_m[i]);
    state_.branch[i] = -1;
    counts_[i] = quantise(sensor_.baseline_counts[i]);
  }
}

void PadArray::touch(std::uint64_t noise_seed, double gain_scale, const Values& ratio) {
  noise_seed_ = noise_seed;
  for (std::size_t i = 0; i < pad_count; ++i)
    sensor_.counts_per_f[i] = gain_scale * ratio[i] * gain_[i] / params_.lsb_f;
}

void PadArray::reset(std::uint64_t noise_seed, double gain_scale) {
  Values alike;
  alike.fill(1);
  touch(noise_seed, gain_scale, alike);
  state_ = {};
  state_.branch.fill(-1);
  Random random(mix(noise_seed, "drift"));
  for (double& drift : state_.drift_counts) drift = params_.drift_counts * random.gaussian();
  Random shared(mix(noise_seed, "shared"));
  state_.common = params_.common_mode * shared.gaussian();
  state_.temperature_k = params_.temperature_k * shared.gaussian();
}

/// Advances the common state of all pads to the next frame.
void PadArray::warm(std::uint64_t frame) {
  if (frame == state_.frame || !(law_.common_kick > 0 || law_.temperature_kick_k > 0)) return;
  state_.frame = frame;
  Random random(mix(mix(noise_seed_, "shared"), frame));
  state_.common = law_.common_retained * state_.common + law_.common_kick * random.gaussian();
  state_.temperature_k = law_.temperature_retained * state_.temperature_k +
                         law_.temperature_kick_k * random.gaussian();
}

double PadArray::shared_gain() const {
  return (1 + state_.common) * (1 + law_.gain_per_k * state_.temperature_k);
}

double PadArray::noise_at(double level_counts) const {
  if (!law_.noise_grows()) return law_.noise_counts;
  const double level = level_counts > 0 ? level_counts : 0;
  return std::sqrt(law_.noise_counts * law_.noise_counts +
                   level * (law_.noise_per_count + level * law_.noise_per_square));
}

/// Pads [first, last), whole lanes. The pressure gets its creep. The branch of the hysteresis is
/// subtracted (the gap lags: less closed while loading, more while unloading). The gap determines
/// the capacitance.
WEFT_SIM_CLONES void PadArray::compute(const Law& law, const Sensor& sensor, const State& from,
                                       const Values& pressure_pa, const Draw& draw,
                                       std::size_t first, std::size_t last, State& to) {
  using simd::Lanes, simd::load, simd::store;
  for (std::size_t i = first; i < last; i += simd::width) {
    const Lanes sampled = load(&pressure_pa[i]);
    const Lanes pressure = sampled <= largest_felt_pa ? sampled : simd::all(largest_felt_pa);
    const Lanes creep = pressure + (load(&from.creep_pa[i]) - pressure) * law.creep_retained;
    Lanes felt = pressure + law.creep * creep;
    store(&to.creep_pa[i], creep);
    Lanes level{}, branch = simd::all(-1);
    if (law.hysteresis > 0) {
      level = simd::log(1.0 + felt * (1 / level_pressure_pa));
      const Lanes moved = level - load(&from.level[i]);
      const Lanes target = moved > 0 ? simd::all(1) : simd::all(-1);
      const Lanes decay = simd::exp(-simd::abs(moved) * law.per_hysteresis_length);
      branch = target + (load(&from.branch[i]) - target) * decay;
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
    store(&to.drift_counts[i], law.drift_retained * load(&from.drift_counts[i]) +
                                   law.drift_kick_counts * load(&draw.kick[i]));
  }
}

/// Noise of one frame. A pair of words gives, by Box and Muller, the noise of two pads eight apart.
/// The unused bits beyond 53 of each word kick the drift of one pad.
WEFT_SIM_CLONES void PadArray::draw_noise(std::uint64_t seed, Draw& draw) {
  using simd::Lanes, simd::load, simd::store;
  constexpr std::size_t half = pad_count / 2;
  Random random(seed);
  std::array<double, half> share, turns;
  for (std::size_t i = 0; i < half; ++i) {
    const std::uint64_t a = random.bits(), b = random.bits();
    share[i] = 1 - Random::uniform_of(a);
    turns[i] = Random::uniform_of(b);
    draw.kick[i] = kick_of(a);
    draw.kick[i + half] = kick_of(b);
  }
  for (std::size_t i = 0; i < half; i += simd::width) {
    const Lanes radius = simd::sqrt(-2.0 * simd::log(load(&share[i])));
    const simd::Turned angle = simd::turned(load(&turns[i]));
    store(&draw.normal[i], radius * angle.cosine);
    store(&draw.normal[i + half], radius * angle.sine);
  }
}

/// Pads without noise and drift draw no random numbers.
PadArray::Draw PadArray::draw_for(std::uint64_t frame) const {
  Draw draw;
  if (law_.is_random())
    draw_noise(mix(noise_seed_, frame), draw);
  else
    draw = {};
  return draw;
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

void PadArray::commit(std::size_t pad, const State& next, const Draw& draw) {
  state_.creep_pa[pad] = next.creep_pa[pad];
  state_.level[pad] = next.level[pad];
  state_.branch[pad] = next.branch[pad];
  state_.drift_counts[pad] = next.drift_counts[pad];
  state_.change_f[pad] = next.change_f[pad];
  const double change_f = next.change_f[pad] + law_.crosstalk * neighbours_f(pad);
  const double level_counts = sensor_.counts_per_f[pad] * change_f;
  counts_[pad] = quantise(sensor_.baseline_counts[pad] + next.drift_counts[pad] +
                          level_counts * shared_gain() + noise_at(level_counts) * draw.normal[pad]);
}

/// The counts of a whole scan, with the same bits as commit() in the order of the stages. Two of a
/// pad's neighbours are new: the one to its left, and the one above or below that an earlier stage
/// converts.
WEFT_SIM_CLONES void PadArray::count_all(const Law& law, const Sensor& sensor, const State& from,
                                         const State& to, const Draw& draw, double gain,
                                         std::array<std::uint16_t, pad_count>& counts) {
  using simd::Lanes, simd::load;
  constexpr std::size_t side = simd::width;
  static_assert(side * side == pad_count);
  const Lanes nothing{};
  const bool grows = law.noise_grows();
  for (std::size_t row = 0; row < side; ++row) {
    const std::size_t at = row * side;
    const Lanes now = load(&to.change_f[at]), was = load(&from.change_f[at]);
    const Lanes left{0, now[0], now[1], now[2]}, right{was[1], was[2], was[3], 0};
    const bool second = row % 2 == 1;  // the second of the two rows of one chip
    const Lanes above = row == 0 ? nothing : load(&(second ? to : from).change_f[at - side]);
    const Lanes below = row == 3 ? nothing : load(&(second ? to : from).change_f[at + side]);
    const Lanes change_f = now + law.crosstalk * (((left + right) + above) + below);
    const Lanes level = load(&sensor.counts_per_f[at]) * change_f;
    Lanes noise = simd::all(law.noise_counts);
    if (grows) {
      const Lanes pressed = level > 0 ? level : nothing;
      noise = simd::sqrt(law.noise_counts * law.noise_counts +
                         pressed * (law.noise_per_count + pressed * law.noise_per_square));
    }
    const Lanes exact = load(&sensor.baseline_counts[at]) + load(&to.drift_counts[at]) +
                        level * gain + noise * load(&draw.normal[at]);
    const Lanes held = exact > 0 ? (exact < 65535.0 ? exact : simd::all(65535)) : nothing;
    const auto whole = __builtin_convertvector(held + 0.5, Whole);
    for (std::size_t i = 0; i < side; ++i) counts[at + i] = static_cast<std::uint16_t>(whole[i]);
  }
}

void PadArray::convert(std::size_t pad, double pressure_pa, std::uint64_t frame) {
  const std::size_t first = pad / simd::width * simd::width, last = first + simd::width;
  Values pressures{};
  pressures[pad] = pressure_pa;
  const Draw draw = draw_for(frame);
  warm(frame);
  State next = state_;
  compute(law_, sensor_, state_, pressures, draw, first, last, next);
  commit(pad, next, draw);
}

void PadArray::convert_stages(const std::array<double, pad_count>& pressure_pa, std::uint64_t frame,
                              int first, int last) {
  const Draw draw = draw_for(frame);
  warm(frame);
  State next = state_;
  compute(law_, sensor_, state_, pressure_pa, draw, 0, pad_count, next);
  if (first == 0 && last == pad_timing::stages) {
    count_all(law_, sensor_, state_, next, draw, shared_gain(), counts_);
    state_ = next;
    return;
  }
  for (int stage = first; stage < last; ++stage)
    for (const int pad : {stage, stage + pad_timing::stages})
      commit(static_cast<std::size_t>(pad), next, draw);
}

}  // namespace weft::sim
