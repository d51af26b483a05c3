#pragma once
// Four doubles at a time; the compiler maps them to the vectors of the processor. The arithmetic is
// the same on every processor: no fused operations, no reordering.

#include <bit>
#include <cstddef>

#include "classifier/base/lanes.hpp"

namespace weft::classifier {

constexpr std::size_t lanes = 4;
using Block = double __attribute__((vector_size(lanes * sizeof(double))));
using BlockBits = long long __attribute__((vector_size(lanes * sizeof(long long))));

struct __attribute__((packed, may_alias)) LooseBlock {
  Block value;
};
WEFT_INLINE Block load(const double* p) {
  return reinterpret_cast<const LooseBlock*>(p)->value;
}
WEFT_INLINE void store(double* p, Block v) {
  reinterpret_cast<LooseBlock*>(p)->value = v;
}
WEFT_INLINE Block all(double v) {
  return Block{v, v, v, v};
}
WEFT_INLINE Block larger(Block a, Block b) {
  return a > b ? a : b;
}

WEFT_INLINE double largest(Block a) {
  const Block b = larger(a, __builtin_shufflevector(a, a, 2, 3, 0, 1));
  const Block c = larger(b, __builtin_shufflevector(b, b, 1, 0, 3, 2));
  return c[0];
}

WEFT_INLINE BlockBits all_bits(std::size_t v) {
  const auto w = static_cast<long long>(v);
  return BlockBits{w, w, w, w};
}
/// Indices of a block's lanes within an array of blocks.
WEFT_INLINE BlockBits lane_numbers(std::size_t block) {
  return BlockBits{0, 1, 2, 3} + static_cast<long long>(block * lanes);
}

template <std::size_t blocks>
WEFT_INLINE double largest_of(const Block (&values)[blocks]) {
  Block half[blocks / 2];
  for (std::size_t b = 0; b < blocks / 2; ++b) half[b] = larger(values[b], values[b + blocks / 2]);
  if constexpr (blocks == 2)
    return largest(half[0]);
  else
    return largest_of(half);
}

/// Index of the last lane equal to `value`; one lane must be. For up to 64 lanes.
template <std::size_t blocks>
WEFT_INLINE std::size_t last_equal(const Block (&values)[blocks], double value) {
  static_assert(blocks * lanes <= 64);
  BlockBits found = {};
  for (std::size_t b = 0; b < blocks; ++b) {
    const BlockBits bits = BlockBits{1, 2, 4, 8} << static_cast<long long>(b * lanes);
    found |= BlockBits(values[b] == all(value)) & bits;
  }
  const auto whole = static_cast<unsigned long long>(found[0] | found[1] | found[2] | found[3]);
  return whole == 0 ? 0 : std::size_t(63 - std::countl_zero(whole));
}

/// exp(r) for |r| <= ln(2) / 2: the series to r^13; its next term is below 5e-18.
template <class V>
WEFT_INLINE V exp_series(V r) {
  constexpr double inverse_factorial[] = {
      1.0 / 6227020800, 1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880, 1.0 / 40320,
      1.0 / 5040,       1.0 / 720,       1.0 / 120,      1.0 / 24,      1.0 / 6,      0.5};
  V sum = inverse_factorial[0] - V{};
  for (int k = 1; k < 12; ++k) sum = sum * r + inverse_factorial[k];
  return (sum * r * r + r) + 1.0;
}

/// exp(x) for x <= 0, as specified by exp_of_negative(); V is four or eight doubles. k = round(x /
/// ln 2) is in the low bits of x / ln 2 + 1.5 2^52.
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
