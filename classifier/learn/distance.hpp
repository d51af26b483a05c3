#pragma once
// Squared distances that grow column by column, and the radial basis function on them.

#include <cstddef>
#include <span>

#include "classifier/base/matrix.hpp"

namespace weft::classifier {

/// value -> exp(-factor value) for factor >= 0 and values >= 0, in place. Within 2 units in the
/// last place of the true result; 0 where that is below 2^-1021. NaN stays NaN. The same on every
/// processor and compiler.
void exp_of_negative(std::span<double> values, double factor);

/// Adds to `squared` [a rows x n] the squared differences of columns from <= k < to, between the
/// rows of a and the first n rows of b. Differences first, then squares: a^2 + b^2 - 2ab loses
/// digits and can turn negative.
void add_squared_distances(const Matrix& a, const Matrix& b, std::size_t from, std::size_t to,
                           Matrix& squared);

/// exp(-gamma d), element by element.
Matrix rbf(const Matrix& squared, double gamma);
/// The same into `out`, which takes its size without a new allocation where it can.
void rbf(const Matrix& squared, double gamma, Matrix& out);

}  // namespace weft::classifier
