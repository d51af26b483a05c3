#pragma once
// Which cells of a full factorial tell most about a response that is a polynomial of the factors:
// a D-optimal subset (Fedorov 1972; the exchange of Cook and Nachtsheim 1980), each cell at most
// once.

#include <cstddef>
#include <vector>

#include "recipes/engine/sweep.hpp"

namespace weft::recipes {

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
