#pragma once
// A sweep: factors whose values are combined, so that a pilot study finds which setting answers
// best. Every combination is a cell; each exploration of the recipe is done in each cell.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace weft::recipes {

/// What can be swept. The names in data sets are those of the SI key.
enum class FactorKind : std::uint8_t {
  force,   ///< set point of P and M
  speed,   ///< along the path of M
  press,   ///< duration of P
  stroke,  ///< length of the path of M, whose shape stays
};

/// "force_n", "speed_mps", "press_s", "stroke_m".
std::string_view factor_name(FactorKind kind);
/// A value as people read it and file names hold it: "3.5N", "0.5mm_s", "6s", "40mm".
std::string format_factor(FactorKind kind, double si);

struct Factor {
  FactorKind kind = FactorKind::force;
  std::vector<double> values;         ///< SI, in the recipe's order, each once
  std::vector<std::string> pointers;  ///< of each value in the recipe
};

/// The terms that the cells of a fraction are chosen for, see d_optimal().
enum class SweepModel : std::uint8_t { linear, quadratic };

struct Fraction {
  double share = 1;  ///< of the full factorial's cells, rounded to whole cells
  SweepModel model = SweepModel::quadratic;
};

/// What stays on the plate while the rest is varied.
enum class BlockBy : std::uint8_t {
  fabric,     ///< every cloth is mounted once: all its replicates, one after the other
  replicate,  ///< every replicate mounts every cloth anew
  none        ///< any trial may follow any other
};

struct Sweep {
  std::vector<Factor> factors;
  std::optional<Fraction> fraction;  ///< none: the full factorial
  std::uint32_t replicates = 1;
  bool randomised = true;
  std::uint64_t seed = 1;  ///< of the order
  BlockBy block_by = BlockBy::fabric;
  /// [cells][factors] index of the value; the first factor changes slowest.
  std::vector<std::vector<std::size_t>> cells;
  double d_efficiency = 1;                ///< of the fraction, against the full factorial
  std::vector<std::string> explorations;  ///< of the recipe, each done in every cell

  /// Of the full factorial; UINT64_MAX when it is more than that.
  [[nodiscard]] std::uint64_t full_cells() const;
  /// The SI values of a cell, in the order of `factors`.
  [[nodiscard]] std::vector<double> values(const std::vector<std::size_t>& cell) const;
};

std::string_view to_string(BlockBy block_by);
std::string_view to_string(SweepModel model);

/// "force 1, 2, 5 N x speed 1, 2 mm/s: all 6 cells, 3 replicates, ...", for people.
std::string sweep_text(const Sweep& sweep);

// Which cells of a full factorial tell most about a response that is a polynomial of the factors:
// a D-optimal subset (Fedorov 1972; the exchange of Cook and Nachtsheim 1980), each cell at most
// once.

/// Rows of the model matrix of a full factorial, [cells][terms]: a constant, each factor scaled to
/// -1 .. 1, and for `quadratic` the products of two factors and the squares of factors of at least
/// three values. A factor of one value has no term.
std::vector<std::vector<double>> model_rows(const std::vector<Factor>& factors, SweepModel model);

struct Subset {
  std::vector<std::size_t> rows;  ///< ascending
  /// (|X'X of the subset / its rows| / |X'X of all / all rows|)^(1 / terms); may exceed 1.
  double d_efficiency = 0;
};

/// `count` of `rows`, at least as many as there are terms and at most all. Deterministic: ties go
/// to the lowest row.
Subset d_optimal(const std::vector<std::vector<double>>& rows, std::size_t count);

}  // namespace weft::recipes
