#pragma once
// Products of small dense matrices of single precision, for the networks.

#include <cstddef>

#include "classifier/base/lanes.hpp"

namespace weft::classifier::vibro {

/// Columns come in so many: rows of matrices are padded to a multiple of it.
inline constexpr std::size_t column_step = 16;
constexpr std::size_t padded_columns(std::size_t columns) {
  return (columns + column_step - 1) / column_step * column_step;
}
using AlignedFloats = std::vector<float, simd::LineAllocator<float>>;

/// out [rows x columns] = a [rows x inner] b [inner x columns], row-major; `columns` a multiple of
/// column_step, rows of `a` `a_stride` apart. Sums in one order: the same bits on every processor.
void product(const float* a, std::size_t rows, std::size_t inner, std::size_t a_stride,
             const float* b, std::size_t columns, float* out);

}  // namespace weft::classifier::vibro
