#pragma once
// Powers of two that bring signals of any level to the same, so that those that share a transform
// do not drown in each other's rounding.

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "classifier/base/lanes.hpp"

namespace weft::classifier {

/// Two factors whose product is 2^exponent: one alone may overflow where the product with a signal
/// does not.
struct PowerOfTwo {
  alignas(64) std::array<double, simd::block_taxels> first{};
  alignas(64) std::array<double, simd::block_taxels> second{};

  void set(std::size_t k, int exponent) {
    first[k] = power(exponent / 2);
    second[k] = power(exponent - exponent / 2);
  }

 private:
  // From the exponent's bits: half an exponent of a double is that of a normal number.
  static double power(int exponent) {
    return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + exponent) << 52);
  }
};

/// std::frexp's exponent, by the bits where the number is normal.
inline int exponent_of(double v) {
  const auto biased = static_cast<int>(std::bit_cast<std::uint64_t>(v) >> 52 & 0x7ff);
  if (biased != 0 && biased != 0x7ff) return biased - 1022;
  int exponent = 0;
  if (v > 0.0) std::frexp(v, &exponent);
  return exponent;
}

/// Of sixteen signals or fewer.
struct Scaling {
  PowerOfTwo in;   ///< brings the largest magnitude into [1/2, 1)
  PowerOfTwo out;  ///< and back; zero for a silent signal, which would show its partner's rounding
};

inline Scaling scaling_of(const double* top, std::size_t signals) {
  Scaling out;
  for (std::size_t k = 0; k < signals; ++k) {
    const int exponent = exponent_of(top[k]);
    out.in.set(k, -exponent);
    out.out.set(k, exponent);
    if (top[k] == 0.0) out.out.first[k] = 0.0;
  }
  return out;
}

/// Magnitudes, scaled back, in the place of four times their squares: [count x signals]. A loop of
/// its own over plain numbers: only so do compilers take roots of all lanes at once, in sources
/// that are compiled with -fno-math-errno.
template <std::size_t signals>
WEFT_INLINE void compute_roots(double* rows, std::size_t count, const PowerOfTwo& scale) {
  PowerOfTwo by = scale;
  for (std::size_t k = 0; k < signals; ++k) by.first[k] *= 0.5;
  for (std::size_t r = 0; r < count; ++r, rows += signals) {
    for (std::size_t k = 0; k < signals; ++k)
      rows[k] = std::sqrt(rows[k]) * by.first[k] * by.second[k];
  }
}

}  // namespace weft::classifier
