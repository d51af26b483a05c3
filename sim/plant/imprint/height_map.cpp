#include "sim/plant/imprint/height_map.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace weft::sim {

namespace {
constexpr std::size_t most_taxels = std::size_t{1} << 22;
constexpr double largest_height_m = 1;
constexpr double largest_force_n = 1e6;
}  // namespace

Status check_grid(std::size_t rows, std::size_t cols, double spacing_m) {
  if (rows == 0 || cols == 0 || rows > most_taxels || cols > most_taxels / rows)
    return fail({.code = Errc::range,
                 .where = "rows x cols",
                 .what = "no array has this size",
                 .expected = "1 to 2^22 taxels",
                 .got = std::to_string(rows) + " x " + std::to_string(cols)});
  if (!(spacing_m >= 1e-6 && spacing_m <= 0.1))  // written so that NaN fails
    return fail({.code = Errc::range,
                 .where = "spacing_m",
                 .what = "no array has this spacing",
                 .expected = "1e-6 to 0.1 m",
                 .got = std::to_string(spacing_m)});
  return {};
}

Status check(const HeightMap& map) {
  if (auto ok = check_grid(map.rows, map.cols, map.spacing_m); !ok) return ok;
  if (map.height_m.size() != map.rows * map.cols)
    return fail({.code = Errc::range,
                 .where = "height_m",
                 .what = "a height map is not rows x cols heights",
                 .expected = std::to_string(map.rows * map.cols),
                 .got = std::to_string(map.height_m.size())});
  const auto bad = std::find_if(map.height_m.begin(), map.height_m.end(),
                                [](double h) { return !(std::abs(h) <= largest_height_m); });
  if (bad != map.height_m.end())
    return fail({.code = Errc::range,
                 .where = "height_m[" + std::to_string(bad - map.height_m.begin()) + "]",
                 .what = "a height is not a height",
                 .expected = "-1 to 1 m",
                 .got = std::to_string(*bad)});
  return {};
}

Status check_press(double force_n) {
  if (force_n >= 0 && force_n <= largest_force_n) return {};
  return fail({.code = Errc::range,
               .where = "force_n",
               .what = "nobody presses with this force",
               .expected = "0 to 1e6 N",
               .got = std::to_string(force_n)});
}

double highest_m(const HeightMap& map) {
  return *std::max_element(map.height_m.begin(), map.height_m.end());
}

double loaded_fraction(const std::vector<double>& pressure_pa) {
  const auto loaded =
      std::count_if(pressure_pa.begin(), pressure_pa.end(), [](double p) { return p > 0; });
  return static_cast<double>(loaded) / static_cast<double>(pressure_pa.size());
}

Result<Imprint> extract_part(const Imprint& whole, std::size_t row, std::size_t col,
                             std::size_t rows, std::size_t cols) {
  const bool inside = rows > 0 && cols > 0 && rows <= whole.rows && cols <= whole.cols &&
                      row <= whole.rows - rows && col <= whole.cols - cols;
  if (!inside)
    return fail(
        {.code = Errc::range,
         .where = "part",
         .what = "the part is not inside the imprint",
         .expected = "within " + std::to_string(whole.rows) + " x " + std::to_string(whole.cols),
         .got = std::to_string(rows) + " x " + std::to_string(cols) + " from " +
                std::to_string(row) + ", " + std::to_string(col)});
  Imprint part{rows, cols, {}, whole.indentation_m, 0};
  part.pressure_pa.reserve(rows * cols);
  for (std::size_t r = row; r < row + rows; ++r) {
    const double* from = whole.pressure_pa.data() + r * whole.cols + col;
    part.pressure_pa.insert(part.pressure_pa.end(), from, from + cols);
  }
  part.contact_fraction = loaded_fraction(part.pressure_pa);
  return part;
}

}  // namespace weft::sim
