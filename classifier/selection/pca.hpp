#pragma once
// Principal components of one core's scaled training rows: what section IV-B of Khan et al. 2016
// compares with.

#include <cstddef>
#include <vector>

#include "classifier/base/matrix.hpp"

namespace weft::classifier {

struct PcaBasis {
  Matrix axes;  ///< [components x features], orthonormal rows, largest variance first
  std::vector<double> explained;  ///< cumulative share of the variance, one per component
};

/// Components of `rows` [n x features], which must have zero column means. At most `cap`
/// components; directions below 1e-7 of the largest deviation are dropped as rounding. The sign of
/// an axis is fixed by its largest entry being positive. No variance at all gives one axis of
/// zeros.
PcaBasis pca_basis(const Matrix& rows, std::size_t cap);

/// The fewest components that explain at least `share` of the variance; at least one, at most all.
std::size_t components_for(const PcaBasis& basis, double share);

}  // namespace weft::classifier
