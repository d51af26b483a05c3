#pragma once
// A sweep combines the values of factors, so that a pilot study finds the best setting. Every
// combination is a cell; each exploration of the recipe is carried out in each cell.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace weft::recipes {

/// Factors that can be swept. The names in data sets are the SI keys.
enum class FactorKind : std::uint8_t {
  force,      ///< set point of P and M
  speed,      ///< along the path of M
  press,      ///< duration of P
  stroke,     ///< length of the path of M; its shape does not change
  direction,  ///< turn of the path of M about its start, from x (warp) towards y (weft)
};

/// "force_n", "speed_mps", "press_s", "stroke_m", "direction_rad".
std::string_view factor_name(FactorKind kind);
/// A value for people and file names: "3.5N", "0.5mm_s", "6s", "40mm", "45deg".
std::string format_factor(FactorKind kind, double si);

struct Factor {
  FactorKind kind = FactorKind::force;
  std::vector<double> values;         ///< SI, in the recipe's order, without duplicates
  std::vector<std::string> pointers;  ///< JSON pointer of each value in the recipe
};

/// Terms of the model that a fraction of the cells is chosen for, see d_optimal().
enum class SweepModel : std::uint8_t { linear, quadratic };

struct Fraction {
  double share = 1;  ///< share of the cells of the full factorial, rounded to whole cells
  SweepModel model = SweepModel::quadratic;
};

/// The mounting that stays on the plate while other factors vary.
enum class BlockBy : std::uint8_t {
  fabric,     ///< every fabric is mounted once: all its replicates follow each other
  replicate,  ///< every replicate mounts every fabric anew
  none        ///< any trial may follow any other
};

struct Sweep {
  std::vector<Factor> factors;
  std::optional<Fraction> fraction;  ///< nullopt: the full factorial
  std::uint32_t replicates = 1;
  bool randomised = true;
  std::uint64_t seed = 1;  ///< of the order
  BlockBy block_by = BlockBy::fabric;
  /// [cells][factors] index of the value; the first factor changes slowest.
  std::vector<std::vector<std::size_t>> cells;
  double d_efficiency = 1;  ///< of the fraction, relative to the full factorial
  std::vector<std::string>
      explorations;  ///< explorations of the recipe; each is carried out in every cell

  /// Cells of the full factorial; UINT64_MAX if larger.
  [[nodiscard]] std::uint64_t full_cells() const;
  /// The SI values of a cell, in the order of `factors`.
  [[nodiscard]] std::vector<double> values(const std::vector<std::size_t>& cell) const;
};

std::string_view to_string(BlockBy block_by);
std::string_view to_string(SweepModel model);

/// "force 1, 2, 5 N x speed 1, 2 mm/s: all 6 cells, 3 replicates, ...", for people.
std::string sweep_text(const Sweep& sweep);

// Choice of the cells that give most information about a response that is a polynomial of the
// factors: a D-optimal subset (Fedorov 1972; the exchange of Cook and Nachtsheim 1980), each cell
// at most once.

/// Rows of the model matrix of a full factorial, [cells][terms]: a constant and each factor scaled
/// to -1 .. 1. `quadratic` adds the products of two factors, and the squares of factors with at
/// least three values. A factor with one value has no term. Requires factors without a direction,
/// which is periodic.
std::vector<std::vector<double>> model_rows(const std::vector<Factor>& factors, SweepModel model);

struct Subset {
  std::vector<std::size_t> rows;  ///< ascending
  /// (|X'X of the subset / its rows| / |X'X of all / all rows|)^(1 / terms); may exceed 1.
  double d_efficiency = 0;
};

/// Chooses `count` of `rows`: at least the number of terms, at most all. Deterministic: ties go to
/// the lowest row.
Subset d_optimal(const std::vector<std::vector<double>>& rows, std::size_t count);

}  // namespace weft::recipes
