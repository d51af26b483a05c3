#include "sim/plant/waviness.hpp"

#include <cmath>
#include <numbers>

#include "sim/plant/random.hpp"

namespace weft::sim {

Waviness::Waviness(const WavinessSpec& spec, std::uint64_t seed) : flat_(!(spec.rms_m > 0)) {
  Random random(seed);
  for (Wave& wave : waves_) {
    const double direction = random.angle();
    const double number =
        2 * std::numbers::pi / random.uniform(spec.shortest_wave_m, spec.longest_wave_m);
    wave.amplitude_m = spec.rms_m * std::sqrt(2.0 / waves);
    wave.kx = number * std::cos(direction);
    wave.ky = number * std::sin(direction);
    wave.phase = random.angle();
  }
}

double Waviness::height_m(double x_m, double y_m) const {
  if (flat_) return 0;
  double height = 0;
  for (const Wave& wave : waves_)
    height += wave.amplitude_m * std::cos(wave.kx * x_m + wave.ky * y_m + wave.phase);
  return height;
}

Waviness::Tangent Waviness::tangent(double x_m, double y_m) const {
  Tangent tangent;
  if (flat_) return tangent;
  for (const Wave& wave : waves_) {
    const double angle = wave.kx * x_m + wave.ky * y_m + wave.phase;
    const double fall = -wave.amplitude_m * std::sin(angle);
    tangent.height_m += wave.amplitude_m * std::cos(angle);
    tangent.slope_x += wave.kx * fall;
    tangent.slope_y += wave.ky * fall;
  }
  return tangent;
}

}  // namespace weft::sim
