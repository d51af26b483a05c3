#pragma once
// Four doubles at a time, mapped by the compiler to what the processor has. The arithmetic is the
// same on every processor: no fused operations, no reordering.

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
/// Numbers of a block's lanes within an array of blocks.
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

/// Number of the last lane that holds `value`, which one of them does; up to 64 lanes.
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

}  // namespace weft::classifier
