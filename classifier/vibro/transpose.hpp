#pragma once
// Eight rows of eight numbers turned into columns.

#include "classifier/base/lanes.hpp"

namespace weft::classifier::vibro {

/// v[i][k] and v[k][i] change places.
WEFT_INLINE void transpose(simd::Lanes* v) {
  using simd::Lanes;
  Lanes pairs[simd::width], fours[simd::width];
  for (std::size_t i = 0; i < simd::width; i += 2) {
    pairs[i] = __builtin_shufflevector(v[i], v[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
    pairs[i + 1] = __builtin_shufflevector(v[i], v[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  }
  for (std::size_t i = 0; i < simd::width; i += 4) {
    for (std::size_t k = 0; k < 2; ++k) {
      const Lanes low = pairs[i + k], high = pairs[i + k + 2];
      fours[i + k] = __builtin_shufflevector(low, high, 0, 1, 8, 9, 4, 5, 12, 13);
      fours[i + k + 2] = __builtin_shufflevector(low, high, 2, 3, 10, 11, 6, 7, 14, 15);
    }
  }
  for (std::size_t i = 0; i < simd::width / 2; ++i) {
    const Lanes low = fours[i], high = fours[i + 4];
    v[i] = __builtin_shufflevector(low, high, 0, 1, 2, 3, 8, 9, 10, 11);
    v[i + 4] = __builtin_shufflevector(low, high, 4, 5, 6, 7, 12, 13, 14, 15);
  }
}

}  // namespace weft::classifier::vibro
