#pragma once
// One static imprint of a tactile array, as the classifier takes it.

#include <cstddef>

#include "classifier/base/matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::imprint {

/// [rows x cols] taxel values in counts, row-major; one taxel apart is the unit of length.
using Image = Matrix;

/// Larger than any reading, and small enough that no sum of squares overflows.
inline constexpr double largest_count = 1e100;
/// 4096 x 4096.
inline constexpr std::size_t most_taxels = std::size_t{1} << 24;

/// Refuses an image without taxels or with more than most_taxels, and a value that is not finite or
/// beyond largest_count (named by row and column): nothing computed from the others can become NaN.
Status check(const Image& image);

}  // namespace weft::classifier::imprint
