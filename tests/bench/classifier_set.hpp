#pragma once
// Made-up fabrics for benchmarks: the model of a synthetic generator in Python, from a portable
// engine. SYNTHETIC: good for comparing methods, without meaning for real fabric.

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "classifier/base/random.hpp"
#include "classifier/features/trial.hpp"

namespace weft::bench {

/// Uniform and normal numbers that are the same with every compiler.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  double normal(double mean, double deviation) {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(0.0, 1.0)));
    return mean + deviation * radius * std::cos(uniform(0.0, 2.0 * std::numbers::pi));
  }
  /// low <= n < end
  std::size_t whole(std::size_t low, std::size_t end) {
    return low + classifier::random_below(engine_, end - low);
  }

 private:
  classifier::RandomEngine engine_;
};

inline constexpr std::size_t bench_taxels = 16;

/// The properties of one made-up fabric.
struct MadeFabric {
  double soft_counts, frequency_hz, amplitude_counts, noise_counts, slip;
  std::array<double, bench_taxels> local_counts;
};

inline MadeFabric make_fabric(Dice& dice) {
  MadeFabric out{dice.normal(5000, 500), dice.uniform(0.8, 9.0), dice.uniform(60, 260),
                 dice.uniform(25, 60),   dice.uniform(0.0, 2.0), {}};
  for (double& v : out.local_counts) v = dice.normal(0, 120);
  return out;
}

/// The sensor, the same in all trials.
struct MadeSensor {
  std::array<double, bench_taxels> gain{}, base_counts{};
  explicit MadeSensor(Dice& dice) {
    for (double& v : gain) v = dice.uniform(0.7, 1.3);
    for (double& v : base_counts) v = dice.uniform(9000, 12000);
  }
};

/// Fills `samples` of one taxel over all phases; texture and noise grow in phase M.
inline void fill_taxel(classifier::Trial& trial, std::size_t taxel, const MadeFabric& fabric,
                       double base, double press, double texture, double frequency_hz, Dice& dice) {
  constexpr double rate_hz = 37.0;
  const double phase = dice.uniform(0.0, 2.0 * std::numbers::pi);
  double noise = 0.0;
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    const bool moving = trial.phase[i] == Phase::motion;
    const bool pressed = moving || trial.phase[i] == Phase::press;
    const double turn = 2.0 * std::numbers::pi * frequency_hz * static_cast<double>(i) / rate_hz;
    double wave = std::sin(turn + phase) + 0.35 * std::sin(2.0 * turn + 1.7 * phase);
    wave += fabric.slip * 0.4 * std::pow(std::max(0.0, wave), 2);
    noise = 0.6 * noise + dice.normal(0.0, 1.2 * fabric.noise_counts);
    const double v = base + (pressed ? 1.0 : 0.35) * press + (moving ? texture * wave : 0.0) +
                     noise * (moving ? 1.0 : 0.3);
    trial.counts[i * bench_taxels + taxel] = std::clamp(std::nearbyint(v), 0.0, 65535.0);
  }
}

inline classifier::Trial make_trial(const MadeFabric& fabric, const MadeSensor& sensor, Dice& dice,
                                    std::size_t motion_samples) {
  classifier::Trial out;
  out.taxels = bench_taxels;
  const auto phase = [&](Phase p, std::size_t samples) {
    out.phase.insert(out.phase.end(), samples, p);
  };
  phase(Phase::rest, dice.whole(70, 80));
  phase(Phase::press, dice.whole(70, 80));
  phase(Phase::motion, motion_samples);
  phase(Phase::end, dice.whole(55, 75));
  out.counts.resize(out.samples() * bench_taxels);
  const double soft = fabric.soft_counts * (1.0 + dice.normal(0.0, 0.05));
  const double frequency_hz = fabric.frequency_hz * (1.0 + dice.normal(0.0, 0.02));
  const double amplitude = fabric.amplitude_counts * (1.0 + dice.normal(0.0, 0.12));
  for (std::size_t k = 0; k < bench_taxels; ++k) {
    const double gain = sensor.gain[k] * (1.0 + dice.normal(0.0, 0.03));
    const double base = sensor.base_counts[k] + dice.normal(0.0, 120.0);
    fill_taxel(out, k, fabric, base, gain * soft + fabric.local_counts[k], amplitude * gain,
               frequency_hz, dice);
  }
  return out;
}

/// `per_fabric` trials of every fabric, fabric by fabric; 915 to 935 samples in M.
inline std::vector<classifier::Trial> made_trials(std::size_t fabrics, std::size_t per_fabric,
                                                  std::uint64_t seed) {
  Dice dice(seed);
  const MadeSensor sensor(dice);
  std::vector<classifier::Trial> out;
  for (std::size_t f = 0; f < fabrics; ++f) {
    const MadeFabric fabric = make_fabric(dice);
    for (std::size_t r = 0; r < per_fabric; ++r) {
      out.push_back(make_trial(fabric, sensor, dice, dice.whole(915, 936)));
      out.back().label = "made" + std::to_string(1000 + f).substr(1);
      out.back().group = std::to_string(r);
      out.back().file = out.back().label + "_" + out.back().group + ".csv";
    }
  }
  return out;
}

}  // namespace weft::bench
