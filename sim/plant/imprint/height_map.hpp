#pragma once
// The face of an object as a grid of heights, and what a press of it leaves on a taxel array.

#include <cstddef>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::sim {

/// Begej's array as Ellis (1986), section 3.1, used it: 128 x 128 taxels over 36 mm square.
constexpr std::size_t array_side = 128;
constexpr std::size_t calibrated_side = 32;  ///< the part that was calibrated at once
constexpr double taxel_spacing_m = 0.28e-3;  ///< section 3.3
constexpr double light_press_n = 20;
constexpr double heavy_press_n = 50;

/// rows x cols heights of a rigid face above any plane, row after row; higher points touch first.
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

/// Refuses none or more than 2^22 taxels and a spacing outside 1 um to 0.1 m.
Status check_grid(std::size_t rows, std::size_t cols, double spacing_m);
/// Refuses what is not a map: no grid, another number of heights than rows x cols, a height that
/// is not within 1 m of zero.
Status check(const HeightMap& map);
/// Refuses what nobody presses with: outside 0 to 1e6 N.
Status check_press(double force_n);

/// Highest point; the map must have one.
double highest_m(const HeightMap& map);
/// Counts the taxels under pressure.
double loaded_fraction(const std::vector<double>& pressure_pa);
/// The `rows` x `cols` taxels from (`row`, `col`) on. Errors: range, for a part that is not inside.
Result<Imprint> extract_part(const Imprint& whole, std::size_t row, std::size_t col,
                             std::size_t rows, std::size_t cols);

}  // namespace weft::sim
