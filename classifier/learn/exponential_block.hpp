#pragma once
// exp of several values at once, for loops that have other work on them.

#include <bit>

#include "classifier/learn/block.hpp"

namespace weft::classifier {

/// exp(r) for |r| <= ln(2) / 2: the series to r^13, whose next term is below 5e-18.
template <class V>
WEFT_INLINE V exp_series(V r) {
  constexpr double inverse_factorial[] = {
      1.0 / 6227020800, 1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880, 1.0 / 40320,
      1.0 / 5040,       1.0 / 720,       1.0 / 120,      1.0 / 24,      1.0 / 6,      0.5};
  V sum = inverse_factorial[0] - V{};
  for (int k = 1; k < 12; ++k) sum = sum * r + inverse_factorial[k];
  return (sum * r * r + r) + 1.0;
}

/// exp(x) for x <= 0, as exp_of_negative() says; V is four or eight doubles. k = round(x / ln 2)
/// comes out of the low bits of x / ln 2 + 1.5 2^52.
template <class V>
WEFT_INLINE V exp_block(V x) {
  using Bits = decltype(x > x);
  constexpr double shifter = 0x1.8p52;
  constexpr double ln2_high = 0x1.62e42feep-1;  // 32 bits, so that k ln2_high is exact
  constexpr double ln2_low = 0x1.a39ef35793c76p-33;
  const V least = -707.0 - V{};
  const V bounded = x < least ? least : x;
  const V shifted = bounded * 0x1.71547652b82fep0 + shifter;
  const V k = shifted - shifter;
  const V r = (bounded - k * ln2_high) - k * ln2_low;
  const auto exponent = (std::bit_cast<Bits>(shifted) + 1023) << 52;
  const V value = exp_series(r) * std::bit_cast<V>(exponent);
  return x < least ? V{} : value;
}

}  // namespace weft::classifier
