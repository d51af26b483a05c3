#include "sim/plant/waviness.hpp"

#include <cmath>
#include <numbers>

#include "sim/plant/random.hpp"

namespace weft::sim {

Waviness::Waviness(const WavinessSpec& spec, std::uint64_t seed) : flat_(!(spec.rms_m > 0)) {
  Random random(seed);
  for (std::size_t i = 0; i < waves; ++i) {
    const double direction = random.angle();
    const double turns = 1 / random.uniform(spec.shortest_wave_m, spec.longest_wave_m);
    amplitude_m_[i] = spec.rms_m * std::sqrt(2.0 / waves);
    turns_x_[i] = turns * std::cos(direction);
    turns_y_[i] = turns * std::sin(direction);
    phase_turns_[i] = random.uniform();
  }
}

Waviness::Tangent Waviness::tangent(double x_m, double y_m) const {
  if (flat_) return {};
  const simd::Lanes x = simd::load(turns_x_.data()), y = simd::load(turns_y_.data());
  const simd::Lanes turns = x * x_m + y * y_m + simd::load(phase_turns_.data());
  const simd::Lanes amplitude = simd::load(amplitude_m_.data());
  const simd::Turned angle = simd::turned(turns);
  const simd::Lanes fall = (-2 * std::numbers::pi) * amplitude * angle.sine;
  return {simd::sum(amplitude * angle.cosine), simd::sum(x * fall), simd::sum(y * fall)};
}

}  // namespace weft::sim
