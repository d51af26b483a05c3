#pragma once
// Effect of the surface on the pads. PadBed has the pressure of all 16 at their conversions.
// TextureMap has the average of e^{h/lambda} over a pad's disc, on a 50 um grid. It is computed in
// square tiles, only where a pad passes. It is divided by the mean over the whole fabric, so that a
// smooth fabric gives 1. The disc consists of square cells: its transfer function is within 0.7 %
// of full scale of the true disc's. Source: docs/reference/plant.md, Pads on a surface. the true
// disc's. Source: docs/reference/plant.md, Pads on a surface.

#include <array>
#include <climits>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "sim/plant/contact.hpp"
#include "sim/plant/height_field.hpp"
#include "sim/plant/lanes.hpp"
#include "sim/plant/pads.hpp"

namespace weft::sim {

class TextureMap {
 public:
  static constexpr int tile_cells = 32;  ///< 1.6 mm
  static constexpr double cell_m = 50e-6;
  static constexpr int disc_cells = 20;  ///< radius 1 mm

  /// Caches the tile of one pad's last look-up.
  struct Cursor {
    int column = INT_MIN;
    int row = INT_MIN;
    const float* tile = nullptr;
  };

  TextureMap() = default;
  /// `lambda_m`: indentation scale of the trial's fabric, > 0.
  TextureMap(HeightField field, double lambda_m);

  /// Disc average at a point of the frame of the yarns, bilinear between cells. Positions further
  /// than 100 m from the origin are clamped.
  double response(double u_m, double v_m, Cursor& cursor);
  /// The same at many points at once; only `sampled` points create tiles.
  template <std::size_t n>
  void responses(const std::array<double, n>& u_m, const std::array<double, n>& v_m,
                 const std::array<bool, n>& sampled, std::array<Cursor, n>& cursors,
                 std::array<double, n>& out) {
    static_assert(n % simd::width == 0);
    for (std::size_t i = 0; i < n; i += simd::width)
      responses_of_four(&u_m[i], &v_m[i], &sampled[i], &cursors[i], &out[i]);
  }
  [[nodiscard]] std::size_t tiles() const { return tiles_.size(); }

 private:
  static constexpr int outputs = tile_cells + 1;           // one more for the interpolation
  static constexpr int window = outputs + 2 * disc_cells;  // raw cells under the average
  static constexpr int padded = (window + 15) / 16 * 16;   // whole vectors
  /// cos and sin of every term along one side of a tile's window; v's include amplitude/lambda.
  struct Strip {
    std::vector<float> cosine, sine;
  };

  void responses_of_four(const double* u_m, const double* v_m, const bool* sampled, Cursor* cursors,
                         double* out);
  const float* tile(int column, int row);
  const Strip& strip(HeightField::Axis axis, int index);
  void fill_strip(Strip& strip, HeightField::Axis axis, int index) const;
  void fill_straight(const HeightField::Term& term, HeightField::Axis axis, double origin_m,
                     float* cosine, float* sine) const;
  void fill_wandering(const HeightField::Term& term, HeightField::Axis axis, double origin_m,
                      const double* wander, float* cosine, float* sine) const;
  void synthesise(const Strip& u, const Strip& v);
  void average(float* out);

  HeightField field_;
  double lambda_m_ = 1;
  float log_mean_ = 0;
  std::unordered_map<std::uint64_t, std::shared_ptr<float[]>> tiles_;  // copies share them
  std::unordered_map<int, Strip> strips_u_, strips_v_;
  std::vector<float> raw_;     // window x padded: e^{h/lambda} of one tile
  std::vector<float> prefix_;  // (window + 1) x padded: running sums along v
};

/// The fabric under the 16 pads: the pressure of each at its conversion. Pads are converted two at
/// a time while the face moves, and their pressures are computed together at the end of a scan.
/// Source: docs/reference/plant.md, Pads on a surface and Pad effects.
class PadBed {
 public:
  using Values = std::array<double, pad_count>;

  PadBed() = default;
  /// `skew_rad` turns the frame of the yarns on the plate; its origin is `offset_*_m` from the
  /// fabric's.
  PadBed(const ContactMaterial& material, HeightField field, double skew_rad, double offset_x_m = 0,
         double offset_y_m = 0);
  /// The same mounted fabric at another place.
  void move(const Waviness& waviness, double offset_x_m, double offset_y_m);
  /// Height of each pad above the face, which adds to its indentation.
  void set_heights(const Values& height_m) { heights_m_ = height_m; }
  /// Wear of the surface: the share `kept` in [0, 1] of the logarithm of its response remains.
  void set_unworn(double kept) { unworn_ = kept; }

  /// The two pads of a stage are converted with the face in the state `contact`.
  void remember(int stage, const ContactState& contact);
  /// The same with the stages at `pose`, at the fraction `share` of the time between two states. In
  /// both states the face touches, with equal slope.
  void remember(int stage, const Pose& pose, const ContactState& before, const ContactState& after,
                double share);
  /// Pressure of the pads of stages [first, last) from the remembered states [Pa]; others do not
  /// change.
  void press(int first, int last, Values& pressure_pa);

  [[nodiscard]] std::size_t tiles() const { return texture_.tiles(); }

 private:
  /// The face at each pad's conversion; load ratio 0 without contact.
  struct Faces {
    Values x_m, y_m, indentation_m, slope_x, slope_y, load_ratio;
  };
  struct Law {
    Waviness waviness;
    double per_lambda, pressure_pa, skew_cos, skew_sin, offset_x_m, offset_y_m;
  };
  static void place(const Law& law, Faces& faces, Values& u_m, Values& v_m);
  static void compute(const Law& law, const Faces& faces, const Values& heights_m,
                      const Values& texture, Values& out_pa);
  static void flatten(double kept, Values& texture);

  Law law_{{}, 1, 0, 1, 0, 0, 0};
  TextureMap texture_;
  std::array<TextureMap::Cursor, pad_count> cursors_{};
  Faces faces_{};
  Values heights_m_{};
  double unworn_ = 1;
};

}  // namespace weft::sim
