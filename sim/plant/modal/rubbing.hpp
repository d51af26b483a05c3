#pragma once
// Forces of a sliding face on probe and plate in addition to those of level L2. Waves of the
// surface pass at v/P and press; asperities pass and scratch. Waves depend on the place, asperities
// on the distance slid, none on time: without motion there is no sound. The wander of the yarns is
// left out: the lines at v/P are sharper than those of a fabric.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/plant/fabric_law.hpp"
#include "sim/plant/height_field.hpp"
#include "sim/plant/modal/modal_bank.hpp"

namespace weft::sim {

/// All [E].
struct RubbingParams {
  double face_half_width_m = 8e-3;
  std::size_t waves = 32;        ///< number of waves that are kept, the strongest ones
  double asperity_share = 2e-3;  ///< rms of the scratching force as a share of the normal force
  double coarsest_m = 200e-6;  ///< longest distance between asperities; seven finer octaves follow
  double finest_share = 0.5;   ///< amplitude of one octave relative to the next coarser (Hurst 1)
};

/// Parameters for a surface of grains `grain_m` apart (0: `params` unchanged, for a fabric). The
/// face rests on n = (side/grain)^2 grains with independent forces. The sum varies by 1/sqrt(n) =
/// grain/side of the whole, so only the grain is an estimate.
RubbingParams with_grain(RubbingParams params, double grain_m);

/// Sum of plane waves' means over a square face pressed on them: sinc(k_x a) sinc(k_y a). Many
/// waves at once, by position, without memory.
class FaceWaves {
 public:
  FaceWaves() = default;
  /// Keeps the `most` waves with the largest mean over the face; the yarns are turned by `skew_rad`
  /// against the face.
  FaceWaves(std::span<const HeightField::Term> terms, double skew_rad, double face_half_width_m,
            std::size_t most);

  /// Mean height under the face [m], |place| <= 1 km.
  [[nodiscard]] double height_m(const Vector2& place_m) const;

 private:
  std::size_t count_ = 0;  // whole groups of lanes
  std::vector<double> amplitude_m_, turns_x_, turns_y_, phase_turns_;
};

/// Noise along a path: octaves of values drawn per cell, linear in between; rms 1.
class Asperities {
 public:
  static constexpr std::size_t octaves = 8;
  Asperities(double coarsest_m, double finest_share, std::uint64_t seed);
  /// 0 <= path_m <= 1e10.
  [[nodiscard]] double at(double path_m);

 private:
  struct Octave {
    double cells_per_m = 0, amplitude = 0;
    std::uint64_t seed = 0;
    std::int64_t cell = -2;      // of the last look-up
    double left = 0, right = 0;  // at its ends
  };
  std::array<Octave, octaves> octaves_{};
};

/// Converts contacts to forces on the structures.
class Rubbing {
 public:
  /// The yarns of `field` are turned by `skew_rad` against the stages. Errors: range, for
  /// parameters that are negative, NaN or out of range.
  static Result<Rubbing> make(const RubbingParams& params, const HeightField& field,
                              std::uint64_t seed, double skew_rad = 0);

  /// Force on the plate along x, y (friction) and z (downwards) at the end of a step; that on the
  /// probe is opposite. NaN counts as 0; larger values are limited to 1 km and 1e6 N. More than 1 m
  /// in a step is a jump and adds nothing to the path.
  Force advance(const SlidingContact& contact);
  /// Distance slid since the start [m].
  [[nodiscard]] double path_m() const { return path_m_; }

 private:
  Rubbing(const RubbingParams& params, const HeightField& field, std::uint64_t seed,
          double skew_rad);

  RubbingParams params_;
  FaceWaves waves_;
  Asperities normal_, tangential_;
  bool started_ = false;
  Vector2 place_m_{}, direction_{};
  double path_m_ = 0;
};

}  // namespace weft::sim
