#pragma once
// Level Z+: a rigid face pressed on an elastic half-space, so that a loaded taxel also lowers its
// neighbours. Contact: conjugate gradients on the loaded taxels (Polonsky, Keer 1999, Wear 231,
// 206). Displacement: convolution with Love's (1929) influence of a uniformly loaded square.
// Source: docs/reference/plant.md, Levels. loaded square. Source: docs/reference/plant.md, Levels.

#include "sim/plant/imprint/fft.hpp"
#include "sim/plant/imprint/height_map.hpp"

namespace weft::sim {

/// 1/E* = (1 - nu^2)/E of the array's cover plus that of the object.
struct HalfSpaceParams {
  double modulus_pa = 2e6;   ///< E*, a soft rubber's [E]
  double tolerance = 1e-10;  ///< change of the pressures in one pass, relative to their sum
  int iteration_limit = 2000;
};

/// Surface displacement at (x, y) per unit pressure on a square of side `side_m` about the origin,
/// for E* = 1 [m/Pa * Pa].
double love_influence(double x_m, double y_m, double side_m);

/// An array of one size on one medium: the kernel's transform is made once for many presses.
/// Thread: one at a time.
class HalfSpace {
 public:
  /// Errors: range, for an array that `check(HeightMap)` would refuse, E* outside 1 to 1e12 Pa, a
  /// tolerance outside 1e-14 to 0.1 or a limit outside 1 to 1e6.
  [[nodiscard]] static Result<HalfSpace> make(std::size_t rows, std::size_t cols, double spacing_m,
                                              const HalfSpaceParams& params);

  /// The imprint of a map of this array's size pressed with `force_n` on its back. Errors: range,
  /// for another size or spacing, a map or a force outside the limits of `check`; timeout, if the
  /// iteration limit is reached first.
  Result<Imprint> press(const HeightMap& map, double force_n);

 private:
  HalfSpace(std::size_t rows, std::size_t cols, double spacing_m, const HalfSpaceParams& params);
  bool solve(const HeightMap& map, double load_pa);
  double gaps_about_their_mean(const HeightMap& map);
  double step_length();
  double aim(double beta);
  [[nodiscard]] double lone_step() const;
  [[nodiscard]] bool overlaps(double rounding_m) const;
  bool descend(double step);
  double change_when_scaled_to(double load_pa);

  std::size_t rows_, cols_;
  double spacing_m_;
  HalfSpaceParams params_;
  double own_influence_;  // of a taxel on itself [m/Pa]
  EvenConvolution influence_;
  int iterations_ = 0;     ///< of the last press
  double mean_gap_m_ = 0;  // displacement minus height, over the contact
  std::vector<double> pressure_, before_, gap_, direction_, response_;
};

}  // namespace weft::sim
