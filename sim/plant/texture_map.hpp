#pragma once
// What the surface does to a pad: the average of e^{h/lambda} over its disc, on a 50 um grid,
// computed in square tiles only where a pad goes. Divided by the mean over the whole cloth, so that
// a smooth cloth gives 1. The disc is made of square cells: its transfer function is within
// 0.7 % of full scale of the true disc's. Source: docs/reference/plant.md, Pads on a surface.

#include <array>
#include <climits>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "sim/plant/height_field.hpp"
#include "sim/plant/lanes.hpp"

namespace weft::sim {

class TextureMap {
 public:
  static constexpr int tile_cells = 32;  ///< 1.6 mm
  static constexpr double cell_m = 50e-6;
  static constexpr int disc_cells = 20;  ///< radius 1 mm

  /// Remembers the tile of the last look-up of one pad.
  struct Cursor {
    int column = INT_MIN;
    int row = INT_MIN;
    const float* tile = nullptr;
  };

  TextureMap() = default;
  /// The indentation scale `lambda_m` of the trial's cloth must be positive.
  TextureMap(HeightField field, double lambda_m);

  /// Disc average at a point of the yarns' frame, bilinear between cells. Pads further than 100 m
  /// from the origin are held there.
  double response(double u_m, double v_m, Cursor& cursor);
  /// The same at many points side by side, of which only those that are `sampled` for make tiles.
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
  static constexpr int window = outputs + 2 * disc_cells;  // raw cells that they average
  static constexpr int padded = (window + 15) / 16 * 16;   // whole vectors
  /// cos and sin of every term along one side of a tile's window; v's carry amplitude/lambda.
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

}  // namespace weft::sim
