#pragma once
// Whether classes are linearly separable at all, said next to a perceptron that stops after 1000
// rounds (choice E5).

#include <cstddef>
#include <span>
#include <string_view>

#include "classifier/base/matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::imprint {

enum class Separability {
  separable,      ///< proved: weights were found that take every row for its class
  not_separable,  ///< proved, to a margin of 1e-7: see separability()
  undecided       ///< the work allowed did not suffice
};
std::string_view to_string(Separability verdict);

struct SeparabilityOutcome {
  Separability verdict = Separability::undecided;
  /// Least distance from the origin that the hull was shown to keep, 0 where it has it inside.
  double margin = 0;
  std::size_t steps = 0;
};

/// Kesler's construction makes one vector of every row and wrong class; classes are separable if
/// and only if one direction has a positive product with all of them, that is if their convex hull
/// does not contain the origin. The hull's point nearest to the origin is found by Wolfe's
/// algorithm (Wolfe 1976, Mathematical Programming 11) on unit vectors of z-scored rows with a
/// bias: scaling changes nothing about separability. `separable` is checked row by row with the
/// weights found; `not_separable` is a convex combination of unit vectors that is at most 1e-7
/// long. Refuses what check_training() refuses.
Result<SeparabilityOutcome> separability(const Matrix& rows, std::span<const std::size_t> of_row,
                                         std::size_t classes, std::size_t most_steps = 20000);

}  // namespace weft::classifier::imprint
