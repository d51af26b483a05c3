#pragma once
// The 16 capacitive pads and their two AD7147: pressure closes the air gap under the conductive
// fabric, and the capacitance is converted to counts. Values and their standing:
// docs/reference/plant.md, Instruments and the force loop; Pad effects.

#include <array>
#include <cstddef>
#include <cstdint>

#include "protocols/base/result.hpp"

namespace weft::sim {

constexpr std::size_t pad_count = 16;
constexpr double pad_pitch_m = 4e-3;

/// Offset of a pad from the face's centre, along x: pad 0 is at (-6, -6) mm, pad 1 next to it along
/// x.
constexpr double pad_dx_m(std::size_t pad) {
  return (static_cast<double>(pad % 4) - 1.5) * pad_pitch_m;
}
constexpr double pad_dy_m(std::size_t pad) {
  return (static_cast<double>(pad / 4) - 1.5) * pad_pitch_m;
}

/// Conversion schedule. Each of two chips converts one pad at a time, so pads are not simultaneous.
namespace pad_timing {
constexpr std::int64_t frame_ns = 27'027'027;  ///< 37 Hz
constexpr std::int64_t stage_ns = 3'072'000;   ///< AD7147, decimation 256: data sheet, table 10
constexpr int stages = 8;                      ///< stage s converts pads s and s + 8
}  // namespace pad_timing

/// All [E] unless marked; zero switches an effect off.
struct PadParams {
  double diameter_m = 2e-3;
  double dielectric_m = 100e-6;  ///< acetate sheet (Khan et al. 2016, section II)
  double dielectric_permittivity = 3.5;
  double gap_m = 10e-6;           ///< g0, air gap without load
  double gap_pressure_pa = 20e3;  ///< p_g, pressure that halves the gap
  double lsb_f = 0.244e-15;       ///< 8 pF over 2^15
  double baseline_low_counts = 4000;
  double baseline_high_counts = 12000;
  double gain_spread = 0.05;  ///< standard deviation of the logarithm of the pads' gains
  double gap_spread = 0.05;
  double crosstalk = 0.04;  ///< share of a neighbour's change at its last conversion
  double creep = 0.03;
  double creep_time_s = 20;
  double hysteresis = 0.01;   ///< eta of the gap's closing and opening
  double drift_counts = 2;    ///< thermal, standard deviation
  double drift_time_s = 600;  ///< its correlation time (Ornstein-Uhlenbeck)
  /// rms at `level` counts above idle: sqrt(noise_counts^2 + noise_per_count level +
  /// noise_per_square level^2).
  double noise_counts = 1.5;
  double noise_per_count = 0;
  double noise_per_square = 0;
  // Common to all pads, as shares of their reading above idle: Ornstein-Uhlenbeck processes.
  double common_mode = 0;
  double common_mode_time_s = 1;
  double temperature_k = 0;  ///< standard deviation
  double temperature_time_s = 1800;
  double gain_per_k = 2e-3;
  double height_spread_m = 0;  ///< of the pads over the face, once per rig, standard deviation
};

/// Errors: range, with the name of the field.
Status check(const PadParams& params);

/// Plate capacitor: dielectric and gap in series [F].
double capacitance_f(const PadParams& params, double gap_m);
/// Nearest count of a 16-bit converter; NaN gives 0.
std::uint16_t quantise(double counts);

class FieldReader;

/// Reads the keys of a rig file's `simulation.pads` and of a fabric table's `sensor`. Errors: as
/// FieldReader::finish().
Status read_pads(FieldReader& reader, PadParams& pads);

class PadArray {
 public:
  /// The parameters must pass check(). `sensor_seed` draws the properties of this sensor: gains,
  /// gaps, baselines.
  PadArray(const PadParams& params, std::uint64_t sensor_seed);

  /// Starts a trial on another fabric: discards creep, hysteresis and drift, scales the gains and
  /// sets the noise seed.
  void reset(std::uint64_t noise_seed, double gain_scale);
  /// Starts a touch that keeps the memory of earlier ones. `ratio`: factor of each pad's gain.
  void touch(std::uint64_t noise_seed, double gain_scale,
             const std::array<double, pad_count>& ratio);
  /// Converts one pad under `pressure_pa` in frame number `frame`, once per pad and frame. NaN, and
  /// pressure beyond any gap, close the gap.
  void convert(std::size_t pad, double pressure_pa, std::uint64_t frame);
  /// Converts the pads of stages [first, last) of a frame in the order of the stages. The bits are
  /// those of single conversions: pads affect each other only through the last conversions.
  void convert_stages(const std::array<double, pad_count>& pressure_pa, std::uint64_t frame,
                      int first = 0, int last = pad_timing::stages);

  [[nodiscard]] const std::array<std::uint16_t, pad_count>& counts() const { return counts_; }

  using Values = std::array<double, pad_count>;
  static constexpr std::uint64_t no_frame = ~std::uint64_t{0};
  /// State after a conversion.
  struct State {
    Values creep_pa, level, branch, drift_counts, change_f;
    double common = 0, temperature_k = 0;
    std::uint64_t frame = no_frame;  ///< frame of `common` and `temperature_k`
  };
  [[nodiscard]] const State& state() const { return state_; }
  void set_state(const State& state) { state_ = state; }

 private:
  /// Constants of the sensor; four pads are computed at once.
  struct Sensor {
    Values gap_m{}, baseline_counts{}, idle_f{}, counts_per_f{};
  };
  /// Random numbers of one frame: a normal one and one in [-1, 1) per pad.
  struct Draw {
    Values normal, kick;
  };
  /// Constants of the conversion, computed once.
  struct Law {
    double creep = 0, creep_retained = 0, hysteresis = 0, per_hysteresis_length = 0;
    double area_f_m = 0, dielectric_m = 0, gap_pressure_pa = 0;
    double drift_retained = 0, drift_kick_counts = 0, crosstalk = 0, noise_counts = 0;
    double noise_per_count = 0, noise_per_square = 0;
    double common_retained = 0, common_kick = 0, temperature_retained = 0, temperature_kick_k = 0;
    double gain_per_k = 0;
    [[nodiscard]] bool is_random() const {
      return noise_counts > 0 || drift_kick_counts > 0 || noise_grows();
    }
    [[nodiscard]] bool noise_grows() const { return noise_per_count > 0 || noise_per_square > 0; }
  };
  static Law law_of(const PadParams& params);
  [[nodiscard]] Draw draw_for(std::uint64_t frame) const;
  static void draw_noise(std::uint64_t seed, Draw& draw);
  static void compute(const Law& law, const Sensor& sensor, const State& from,
                      const Values& pressure_pa, const Draw& draw, std::size_t first,
                      std::size_t last, State& to);
  static void count_all(const Law& law, const Sensor& sensor, const State& from, const State& to,
                        const Draw& draw, double gain,
                        std::array<std::uint16_t, pad_count>& counts);
  void commit(std::size_t pad, const State& next, const Draw& draw);
  void warm(std::uint64_t frame);
  [[nodiscard]] double shared_gain() const;
  [[nodiscard]] double noise_at(double level_counts) const;
  [[nodiscard]] double neighbours_f(std::size_t pad) const;

  PadParams params_;
  Law law_;
  std::uint64_t noise_seed_;
  Values gain_{};
  Sensor sensor_;
  State state_{};
  std::array<std::uint16_t, pad_count> counts_{};
};

}  // namespace weft::sim
