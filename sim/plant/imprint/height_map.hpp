#pragma once
// The face of an object as a grid of heights, and its imprint on a taxel array.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::sim {

/// Begej's array as used by Ellis (1986), section 3.1: 128 x 128 taxels over 36 mm square.
constexpr std::size_t array_side = 128;
constexpr std::size_t calibrated_side = 32;  ///< side of the part that was calibrated at once
constexpr double taxel_spacing_m = 0.28e-3;  ///< section 3.3
constexpr double light_press_n = 20;
constexpr double heavy_press_n = 50;

/// rows x cols heights of a rigid face above any plane, row by row; higher points touch first.
struct HeightMap {
  std::size_t rows = 0;
  std::size_t cols = 0;
  double spacing_m = taxel_spacing_m;  ///< of the square grid
  std::vector<double> height_m;

  [[nodiscard]] double cell_m2() const { return spacing_m * spacing_m; }
};

/// One static press.
struct Imprint {
  std::size_t rows = 0;
  std::size_t cols = 0;
  std::vector<double> pressure_pa;  ///< rows x cols, never negative
  double indentation_m = 0;         ///< of the highest point into the unloaded surface
  double contact_fraction = 0;      ///< share of the taxels under pressure
};

/// Errors: range, for no or more than 2^22 taxels and a spacing outside 1 um to 0.1 m.
Status check_grid(std::size_t rows, std::size_t cols, double spacing_m);
/// Errors: range, for an invalid grid, a number of heights other than rows x cols, and a height
/// that is not within 1 m of zero.
Status check(const HeightMap& map);
/// Errors: range, for a force outside 0 to 1e6 N.
Status check_press(double force_n);

/// Highest point; the map must have at least one.
double highest_m(const HeightMap& map);
/// Share of the taxels under pressure.
double loaded_fraction(const std::vector<double>& pressure_pa);
/// The `rows` x `cols` taxels from (`row`, `col`) on. Errors: range, for a part that is not inside.
Result<Imprint> extract_part(const Imprint& whole, std::size_t row, std::size_t col,
                             std::size_t rows, std::size_t cols);

// Level Z: a rigid face pressed on independent springs side by side (Winkler). For a known set of
// touching taxels the depth follows from the force in closed form:
//   linear       p = (P/L) d            depth = (F' - sum t)/n,          F' = F L/(A P)
//   exponential  p = P (e^{d/L} - 1)    e^{depth/L} = (F' + n)/sum e^{t/L}, F' = F/(A P)
// with t <= 0 the heights below the highest point. Source: docs/reference/plant.md, Closed forms
// (13) and Levels.

/// Pressure of one spring under an indentation; both laws have the stiffness P/L at first touch.
struct SpringLaw {
  enum class Kind { linear, exponential };
  Kind kind = Kind::linear;
  double pressure_pa = 0;  ///< P
  double length_m = 0;     ///< L

  static SpringLaw linear(double stiffness_pa_m) {
    return {Kind::linear, stiffness_pa_m * 1e-3, 1e-3};
  }
};

/// The imprint of `map` pressed with `force_n` on its back, exact except for rounding, O(n log n).
/// Errors: range, for a map, force or law outside the limits of `check`; P in 1e-6 to 1e12 Pa, L in
/// 1e-9 to 1 m.
Result<Imprint> press_winkler(const HeightMap& map, const SpringLaw& law, double force_n);

// Conversion of pressures to counts by the array: 7 bits, a ceiling, and a cover with hysteresis.
// Source: Ellis (1986), section 3.1.

struct TaxelParams {
  double full_scale_pa = 150e3;  ///< pressure of the highest count [E]
  int bits = 7;                  ///< "approximately 7 bits/taxel"
  double hysteresis = 0.25;      ///< share of the pressure by which a reading may exceed it; the
                                 ///< source: hysteresis leaves "one part in four" of the force
  double noise_counts = 0.4;     ///< rms [E]
};

/// Errors: range, for a full scale outside 1 Pa to 1 GPa, other than 1 to 12 bits, hysteresis
/// outside 0 to 4, noise outside 0 to 100 counts.
Status check(const TaxelParams& params);

/// One frame.
struct TaxelFrame {
  std::size_t rows = 0;
  std::size_t cols = 0;
  std::vector<std::uint16_t> counts;  ///< rows x cols, 0 to 2^bits - 1
  double saturated_fraction = 0;
};

/// Memory of the cover: the last reading of each taxel [Pa]; empty before the first press.
struct CoverState {
  std::vector<double> felt_pa;
};

/// Follows a rise at once, and a fall only when the pressure is below felt/(1 + hysteresis). This
/// is a play operator without rate, so that any path between the same extremes gives the same
/// reading. Errors: range, for parameters that `check` refuses, a pressure that is negative or NaN,
/// or a state of another size.
Result<TaxelFrame> read_taxels(const TaxelParams& params, const Imprint& imprint, CoverState& cover,
                               std::uint64_t noise_seed);

}  // namespace weft::sim
