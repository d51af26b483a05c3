#pragma once
// Four doubles side by side, mapped by the compiler to what the processor has, and copies of a hot
// loop for processors with wider vectors, chosen when the program starts. Lanes never mix and
// nothing is fused, so that every copy, processor and compiler computes the same bits.

#include <cstddef>

// Lanes are passed by value only between functions that are always inlined: no call, no ABI.
#pragma GCC diagnostic ignored "-Wpsabi"

#define WEFT_SIM_INLINE [[gnu::always_inline]] inline
// The choice comes before the thread sanitizer is there, which crashes. clang 14 names such copies
// so that its own linker does not find them.
#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define WEFT_SIM_CLONES [[gnu::target_clones("avx2", "default")]]
#else
#define WEFT_SIM_CLONES
#endif

namespace weft::sim::simd {

inline constexpr std::size_t width = 4;  // wider ones gcc 12 takes apart through memory
using Lanes = double __attribute__((vector_size(width * sizeof(double))));

/// Lanes anywhere in an array of doubles, on whatever boundary.
struct __attribute__((packed, may_alias)) Loose {
  Lanes value;
};
WEFT_SIM_INLINE Lanes load(const double* p) {
  return reinterpret_cast<const Loose*>(p)->value;
}
WEFT_SIM_INLINE void store(double* p, const Lanes& v) {
  reinterpret_cast<Loose*>(p)->value = v;
}

}  // namespace weft::sim::simd
