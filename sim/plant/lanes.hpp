#pragma once
// Vectors of four doubles, which the compiler maps to the processor's instructions. Hot loops have
// copies for processors with wider vectors, chosen at program start. Lanes never mix and no
// operation is fused, so every copy, processor and compiler computes the same bits.

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

// Lanes are passed by value only between always-inlined functions: no call, no ABI.
#pragma GCC diagnostic ignored "-Wpsabi"

#define WEFT_SIM_INLINE [[gnu::always_inline]] inline
// The copies are selected before the thread sanitizer is initialised, which then crashes. clang 14
// gives such copies names that its own linker does not find.
#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define WEFT_SIM_CLONES [[gnu::target_clones("avx2", "default")]]
#else
#define WEFT_SIM_CLONES
#endif

namespace weft::sim::simd {

inline constexpr std::size_t width = 4;  // gcc 12 splits wider ones through memory
using Lanes = double __attribute__((vector_size(width * sizeof(double))));

/// Lanes at any alignment in an array of doubles.
struct __attribute__((packed, may_alias)) Loose {
  Lanes value;
};
WEFT_SIM_INLINE Lanes load(const double* p) {
  return reinterpret_cast<const Loose*>(p)->value;
}
WEFT_SIM_INLINE void store(double* p, const Lanes& v) {
  reinterpret_cast<Loose*>(p)->value = v;
}

// e^x, ln x, square roots and circular functions of four doubles at once, without branches and
// library calls. Errors are a few units in the last place (measured in
// tests/unit/plant/lanes_test.cpp). Method: exact reduction, then Taylor polynomials with a
// truncation error below rounding.

using Bits = std::int64_t __attribute__((vector_size(width * sizeof(std::int64_t))));

using Words = std::uint64_t __attribute__((vector_size(width * sizeof(std::uint64_t))));

inline constexpr double whole_shifter = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds

WEFT_SIM_INLINE Bits bits_of(const Lanes& x) {
  return reinterpret_cast<const Bits&>(x);
}
WEFT_SIM_INLINE Lanes from_bits(const Bits& x) {
  return reinterpret_cast<const Lanes&>(x);
}
WEFT_SIM_INLINE Lanes all(double x) {
  return Lanes{x, x, x, x};
}
WEFT_SIM_INLINE double sum(const Lanes& x) {
  return (x[0] + x[2]) + (x[1] + x[3]);
}
WEFT_SIM_INLINE Lanes abs(const Lanes& x) {
  return x < 0 ? -x : x;
}

WEFT_SIM_INLINE Lanes sqrt(const Lanes& x) {
#ifdef __SSE2__
  const __m128d low = _mm_sqrt_pd(__m128d{x[0], x[1]}), high = _mm_sqrt_pd(__m128d{x[2], x[3]});
  return Lanes{low[0], low[1], high[0], high[1]};
#else
  return Lanes{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
#endif
}

/// e^x for |x| <= 700; arguments beyond are clamped.
WEFT_SIM_INLINE Lanes exp(const Lanes& x) {
  const Lanes above = x > -700.0 ? x : all(-700);
  const Lanes held = above < 700.0 ? above : all(700);
  const Lanes shifted = held * std::numbers::log2e + whole_shifter;
  const Lanes n = shifted - whole_shifter;
  // ln 2 in two parts, the first with enough trailing zeros that n times it is exact.
  const Lanes r = (held - n * 0x1.62e42fee00000p-1) - n * 0x1.a39ef35793c76p-33;
  const Lanes r2 = r * r, r4 = r2 * r2;
  const Lanes low = (0.5 + r * (1.0 / 6)) + r2 * (1.0 / 24 + r * (1.0 / 120)) +
                    r4 * ((1.0 / 720 + r * (1.0 / 5040)) + r2 * (1.0 / 40320 + r * (1.0 / 362880)));
  const Lanes high =
      (1.0 / 3628800 + r * (1.0 / 39916800)) + r2 * (1.0 / 479001600 + r * (1.0 / 6227020800.0));
  const Lanes value = 1.0 + (r + r2 * (low + r4 * r4 * high));
  return from_bits(bits_of(value) + (bits_of(shifted) << 52));
}

/// ln x for positive normal numbers; undefined for others.
WEFT_SIM_INLINE Lanes log(const Lanes& x) {
  // x = 2^k m with m in [sqrt(1/2), sqrt 2); ln m = 2 atanh(f/(2 + f)) with f = m - 1.
  constexpr std::int64_t root_half = 0x3FE6A09E667F3BCD, mantissa = 0x000FFFFFFFFFFFFF;
  constexpr std::int64_t bias = std::int64_t{1024} << 52;
  const Bits offset = bits_of(x) - (root_half - bias);
  const Bits m_bits = (offset & mantissa) + root_half;
  // The exponent as a double: its bits below those of 1.5 * 2^52. With its bias it is positive,
  // because AVX2 has no arithmetic shift.
  const Words biased = reinterpret_cast<const Words&>(offset) >> 52;
  const Bits k_bits =
      reinterpret_cast<const Bits&>(biased) + std::bit_cast<std::int64_t>(whole_shifter);
  const Lanes k = from_bits(k_bits) - (whole_shifter + 1024);
  const Lanes f = from_bits(m_bits) - 1.0, s = f / (2.0 + f), z = s * s, z2 = z * z, z4 = z2 * z2;
  const Lanes series =
      ((1.0 / 3 + z * (1.0 / 5)) + z2 * (1.0 / 7 + z * (1.0 / 9))) +
      z4 * ((1.0 / 11 + z * (1.0 / 13)) + z2 * (1.0 / 15 + z * (1.0 / 17)) + z4 * (1.0 / 19));
  // ln m = f - s (f - 2 z series): the large part is exact.
  return k * 0x1.62e42fee00000p-1 + (f - (s * (f - 2.0 * z * series) - k * 0x1.a39ef35793c76p-33));
}

/// sin of y for |y| <= pi/2.
WEFT_SIM_INLINE Lanes sine_of_quarter(const Lanes& y) {
  const Lanes z = y * y, z2 = z * z, z4 = z2 * z2;
  const Lanes p = ((-1.0 / 6 + z * (1.0 / 120)) + z2 * (-1.0 / 5040 + z * (1.0 / 362880))) +
                  z4 * ((-1.0 / 39916800 + z * (1.0 / 6227020800.0)) +
                        z2 * (-1.0 / 1307674368000.0 + z * (1.0 / 355687428096000.0)) +
                        z4 * (-1.0 / 121645100408832000.0 + z * (1.0 / 51090942171709440000.0)));
  return y + y * z * p;
}

/// cos(2 pi turns), |turns| up to 1e6.
WEFT_SIM_INLINE Lanes cosine_of_turns(const Lanes& turns) {
  const Lanes whole = (turns + whole_shifter) - whole_shifter;
  return sine_of_quarter(2 * std::numbers::pi * (0.25 - abs(turns - whole)));
}

/// Cosine and sine of 2 pi turns.
struct Turned {
  Lanes cosine, sine;
};
WEFT_SIM_INLINE Turned turned(const Lanes& turns) {
  const Lanes shifted = 4.0 * turns + whole_shifter;
  const Lanes rest = turns - 0.25 * (shifted - whole_shifter);
  const Lanes y = (2 * std::numbers::pi) * rest, z = y * y, z2 = z * z, z4 = z2 * z2;
  const Lanes odd =
      ((-1.0 / 6 + z * (1.0 / 120)) + z2 * (-1.0 / 5040 + z * (1.0 / 362880))) +
      z4 * ((-1.0 / 39916800 + z * (1.0 / 6227020800.0)) + z2 * (-1.0 / 1307674368000.0));
  const Lanes even = ((-0.5 + z * (1.0 / 24)) + z2 * (-1.0 / 720 + z * (1.0 / 40320))) +
                     z4 * ((-1.0 / 3628800 + z * (1.0 / 479001600)) +
                           z2 * (-1.0 / 87178291200.0 + z * (1.0 / 20922789888000.0)));
  const Lanes s = y + y * z * odd, c = 1.0 + z * even;
  // Quarter turns exchange the two and change signs. The quadrant is in the bits of the shifted
  // number.
  const Bits quadrant = bits_of(shifted);
  const Bits swaps = (quadrant & 1) != 0;
  const Bits sine_sign = (quadrant & 2) << 62, cosine_sign = ((quadrant + 1) & 2) << 62;
  return {from_bits(bits_of(swaps ? s : c) ^ cosine_sign),
          from_bits(bits_of(swaps ? c : s) ^ sine_sign)};
}

}  // namespace weft::sim::simd
