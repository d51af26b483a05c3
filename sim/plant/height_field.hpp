#pragma once
// The surface of a fabric as a sum of plane waves: the lattice of its yarns and a random part. All
// waves are separable, cos(a + b) = cos a cos b - sin a sin b with a along one axis and b along the
// other. A field therefore needs no trigonometry per point. Source: docs/reference/plant.md,
// Surface.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/plant/lanes.hpp"

namespace weft::sim {

/// Slow waviness of the fabric's thickness, common to the force and to all pads. A few plane waves,
/// longer than the width of the face.
struct WavinessSpec {
  double rms_m = 3e-6;             ///< [E]; 0: no waviness
  double shortest_wave_m = 20e-3;  ///< longer than the 16 mm face
  double longest_wave_m = 80e-3;
};

class Waviness {
 public:
  static constexpr std::size_t waves = 4;
  Waviness() = default;
  Waviness(const WavinessSpec& spec, std::uint64_t seed);

  /// Height of the fabric above its mean thickness at a point of the fabric frame [m].
  [[nodiscard]] WEFT_SIM_INLINE double height_m(double x_m, double y_m) const {
    if (flat_) return 0;
    const simd::Lanes turns = simd::load(turns_x_.data()) * x_m +
                              simd::load(turns_y_.data()) * y_m + simd::load(phase_turns_.data());
    return simd::sum(simd::load(amplitude_m_.data()) * simd::cosine_of_turns(turns));
  }
  /// The same at four points at once.
  [[nodiscard]] WEFT_SIM_INLINE simd::Lanes heights_m(const simd::Lanes& x_m,
                                                      const simd::Lanes& y_m) const {
    simd::Lanes height{};
    if (flat_) return height;
    for (std::size_t i = 0; i < waves; ++i)
      height += amplitude_m_[i] *
                simd::cosine_of_turns(turns_x_[i] * x_m + turns_y_[i] * y_m + phase_turns_[i]);
    return height;
  }
  /// Height and slopes along x and y: the tangent plane of the waves at a point.
  struct Tangent {
    double height_m = 0, slope_x = 0, slope_y = 0;
  };
  [[nodiscard]] Tangent tangent(double x_m, double y_m) const;
  /// The same waves, shifted: its origin is the point (`x_m`, `y_m`) of this.
  [[nodiscard]] Waviness shifted(double x_m, double y_m) const;

 private:
  // In turns; four waves fill the lanes.
  std::array<double, waves> amplitude_m_{}, turns_x_{}, turns_y_{}, phase_turns_{};
  bool flat_ = true;
};

/// Composition of the surface of one kind of fabric. Shares are of the variance of the height;
/// their sum is 1.
struct Structure {
  struct Line {
    double warp = 0;  ///< cycles per warp pitch, along x
    double weft = 0;  ///< cycles per weft pitch, along y
    double share = 0;
    double phase_rad = 0;
  };
  std::vector<Line> lines;
  double isotropic_share = 0;  ///< random, any direction
  double streak_share = 0;     ///< random, along one of the yarn systems (thick and thin yarns)
  double low_per_m = 100;      ///< band of the random parts, evenly spread over the logarithm
  double high_per_m = 3000;
  double jitter_rad = 0;  ///< rms of the slow wander of the yarn spacing
};

/// The surface of one fabric before a patch is cut.
struct SurfaceSpec {
  double warp_pitch_m = 0;  ///< spacing along x; 0 without a lattice
  double weft_pitch_m = 0;  ///< spacing along y (the direction of M1)
  double height_rms_m = 0;  ///< 0: smooth
  Structure structure;
};

/// A patch's surface in the frame of its yarns (u along x, v along y when not skewed).
class HeightField {
 public:
  /// One separable term: phase_u(u) + phase_v(v).
  struct Term {
    double amplitude_m = 0;
    double ku = 0, kv = 0;  ///< [rad/m]
    double phase_rad = 0;
    double jitter_u = 0, jitter_v = 0;  ///< cycles per pitch: share of the wander of the yarns
  };
  enum class Axis { u, v };

  HeightField() = default;
  HeightField(const SurfaceSpec& spec, std::uint64_t seed);

  [[nodiscard]] const std::vector<Term>& terms() const { return terms_; }
  /// The same field, shifted: its origin is the point (`u_m`, `v_m`) of this.
  [[nodiscard]] HeightField shifted(double u_m, double v_m) const;
  /// Wander of the yarns that are counted along `axis` [rad per pitch].
  [[nodiscard]] double wander(Axis axis, double at_m) const;
  /// Phase of `term` along one axis for the wander `wander` of that axis; the constant phase is in
  /// u's.
  [[nodiscard]] static double phase(const Term& term, Axis axis, double at_m, double wander);
  /// ln of the mean of e^{h/lambda} over an unbounded fabric: the lattice by quadrature over its
  /// cells, the random waves in closed form (modified Bessel function I0).
  [[nodiscard]] double log_mean_response(double lambda_m) const;

 private:
  struct Wander {
    static constexpr std::size_t waves = 4;
    std::array<double, waves> number{}, phase{};
    double amplitude = 0;
    [[nodiscard]] double at(double coordinate_m) const;
  };
  [[nodiscard]] int lattice_repeat() const;
  [[nodiscard]] double lattice_height_m(int i, int j) const;
  void add_lines(const SurfaceSpec& spec, double offset_u_rad, double offset_v_rad);

  std::vector<Term> terms_;
  std::size_t lattice_terms_ = 0;  ///< number of lattice terms, which come first
  Wander wander_u_, wander_v_;
};

}  // namespace weft::sim
