#pragma once
// Slow waviness of the cloth's thickness: common to the force and to all pads. Few plane waves,
// longer than the face is wide.

#include <array>
#include <cstddef>
#include <cstdint>

#include "sim/plant/lanes_math.hpp"

namespace weft::sim {

struct WavinessSpec {
  double rms_m = 3e-6;             ///< [E]; 0 switches it off
  double shortest_wave_m = 20e-3;  ///< longer than the 16 mm face
  double longest_wave_m = 80e-3;
};

class Waviness {
 public:
  static constexpr std::size_t waves = 4;
  Waviness() = default;
  Waviness(const WavinessSpec& spec, std::uint64_t seed);

  /// Height of the cloth above its mean thickness at a point of the fabric frame [m].
  [[nodiscard]] WEFT_SIM_INLINE double height_m(double x_m, double y_m) const {
    if (flat_) return 0;
    const simd::Lanes turns = simd::load(turns_x_.data()) * x_m +
                              simd::load(turns_y_.data()) * y_m + simd::load(phase_turns_.data());
    return simd::sum(simd::load(amplitude_m_.data()) * simd::cosine_of_turns(turns));
  }
  /// The same at four points side by side.
  [[nodiscard]] WEFT_SIM_INLINE simd::Lanes heights_m(const simd::Lanes& x_m,
                                                      const simd::Lanes& y_m) const {
    simd::Lanes height{};
    if (flat_) return height;
    for (std::size_t i = 0; i < waves; ++i)
      height += amplitude_m_[i] *
                simd::cosine_of_turns(turns_x_[i] * x_m + turns_y_[i] * y_m + phase_turns_[i]);
    return height;
  }
  /// Height and its slopes along x and y: the plane that touches the waves at a point.
  struct Tangent {
    double height_m = 0, slope_x = 0, slope_y = 0;
  };
  [[nodiscard]] Tangent tangent(double x_m, double y_m) const;

 private:
  // Side by side, in turns: four waves fill the lanes.
  std::array<double, waves> amplitude_m_{}, turns_x_{}, turns_y_{}, phase_turns_{};
  bool flat_ = true;
};

}  // namespace weft::sim
