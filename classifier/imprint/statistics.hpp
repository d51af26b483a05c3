#pragma once
// Mean and spread of what was found in an imprint: of lengths, and of directions.

#include <span>

#include "classifier/imprint/step_edges.hpp"

namespace weft::classifier::imprint {

struct Moments {
  double mean = 0;       ///< 0 of nothing
  double deviation = 0;  ///< biased; 0 of fewer than two
};
Moments moments(std::span<const double> values);

/// How the orientations of edges are spread (choice E3).
enum class OrientationSpread {
  /// sqrt(-2 ln R) / 2 in radians, of directions modulo pi: an edge has no front. R is their mean
  /// resultant length, at least 1/n. 0 of fewer than two.
  circular,
  /// Standard deviation of the gradient's angle in (-pi, pi], as if an angle were a length.
  linear
};
double orientation_spread(std::span<const EdgeTaxel> edges, OrientationSpread kind);

}  // namespace weft::classifier::imprint
