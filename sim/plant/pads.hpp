#pragma once
// The 16 capacitive pads and their two AD7147: pressure closes the air gap under the conductive
// fabric, capacitance is converted to counts. Figures and their standing: reference
// sim.md 1.3, 2.4.

#include <array>
#include <cstddef>
#include <cstdint>

#include "sim/plant/hysteresis.hpp"

namespace weft::sim {

constexpr std::size_t pad_count = 16;
constexpr double pad_pitch_m = 4e-3;

/// Offset of a pad from the face's centre, along x: pad 0 is at (-6, -6) mm, pad 1 beside it along
/// x.
constexpr double pad_dx_m(std::size_t pad) {
  return (static_cast<double>(pad % 4) - 1.5) * pad_pitch_m;
}
constexpr double pad_dy_m(std::size_t pad) {
  return (static_cast<double>(pad / 4) - 1.5) * pad_pitch_m;
}

/// Conversion schedule. Two chips convert one pad each at a time, so pads are not simultaneous.
namespace pad_timing {
constexpr std::int64_t frame_ns = 27'027'027;  ///< 37 Hz
constexpr std::int64_t stage_ns = 3'072'000;   ///< AD7147, decimation 256 [S3]
constexpr int stages = 8;                      ///< stage s converts pads s and s + 8
}  // namespace pad_timing

/// All [E] unless marked; each switch can be turned off by a zero.
struct PadParams {
  double diameter_m = 2e-3;
  double dielectric_m = 100e-6;  ///< acetate sheet (Khan et al. 2016, section II)
  double dielectric_permittivity = 3.5;
  double gap_m = 10e-6;           ///< g0, air gap without load
  double gap_pressure_pa = 20e3;  ///< p_g, load that halves the gap
  double lsb_f = 0.244e-15;       ///< 8 pF over 2^15 [C.1]
  double baseline_low_counts = 4000;
  double baseline_high_counts = 12000;
  double gain_spread = 0.05;  ///< of pads, standard deviation
  double gap_spread = 0.05;
  double crosstalk = 0.04;  ///< of a neighbour's change; neighbours as last converted
  double creep = 0.03;
  double creep_time_s = 20;
  double hysteresis = 0.01;   ///< eta of the gap's closing and opening
  double drift_counts = 2;    ///< thermal, standard deviation
  double drift_time_s = 600;  ///< its correlation time (Ornstein-Uhlenbeck)
  double noise_counts = 1.5;  ///< rms, 1 to 2
};

/// Gap that is left under `pressure_pa` >= 0 [m].
double air_gap_m(const PadParams& params, double pressure_pa, double gap_m);
/// Plate capacitor: dielectric and gap in series [F].
double capacitance_f(const PadParams& params, double gap_m);
/// Nearest count a 16-bit converter can give; NaN gives 0.
std::uint16_t quantise(double counts);

class PadArray {
 public:
  /// `sensor_seed` draws what belongs to this sensor: gains, gaps, baselines.
  PadArray(const PadParams& params, std::uint64_t sensor_seed);

  /// A new trial: creep and hysteresis forgotten, gains scaled, noise from `noise_seed`.
  void reset(std::uint64_t noise_seed, double gain_scale);
  /// Converts one pad under `pressure_pa` in frame number `frame`. Once per pad and frame.
  void convert(std::size_t pad, double pressure_pa, std::uint64_t frame);

  [[nodiscard]] const std::array<std::uint16_t, pad_count>& counts() const { return counts_; }

 private:
  struct Pad {
    double gain = 1, gap_m = 0, baseline_counts = 0, idle_f = 0;                  // the sensor's
    double creep_pa = 0, level = 0, branch = -1, drift_counts = 0, change_f = 0;  // state
  };
  double felt_pa(Pad& pad, double pressure_pa) const;
  [[nodiscard]] double neighbours_f(std::size_t pad) const;

  PadParams params_;
  double creep_keep_, drift_keep_;
  std::uint64_t noise_seed_;
  double gain_scale_ = 1;
  std::array<Pad, pad_count> pads_{};
  std::array<std::uint16_t, pad_count> counts_{};
};

}  // namespace weft::sim
