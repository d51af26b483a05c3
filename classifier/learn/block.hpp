#pragma once
// Four doubles at a time, mapped by the compiler to what the processor has. The arithmetic is the
// same on every processor: no fused operations, no reordering.

#include <cstddef>

// Blocks are passed by value only between functions that are always inlined: no call, no ABI.
#pragma GCC diagnostic ignored "-Wpsabi"

#define WEFT_INLINE [[gnu::always_inline]] inline
// clang 14 names such clones so that its own linker does not find them.
#if defined(__x86_64__) && !defined(__clang__)
#define WEFT_FOR_THIS_PROCESSOR [[gnu::target_clones("avx2", "default")]]
#else
#define WEFT_FOR_THIS_PROCESSOR
#endif

namespace weft::classifier {

constexpr std::size_t lanes = 4;
using Block = double __attribute__((vector_size(lanes * sizeof(double)), aligned(8)));
using BlockBits = long long __attribute__((vector_size(lanes * sizeof(long long))));

WEFT_INLINE Block load(const double* p) {
  return *reinterpret_cast<const Block*>(p);
}
WEFT_INLINE void store(double* p, Block v) {
  *reinterpret_cast<Block*>(p) = v;
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

}  // namespace weft::classifier
