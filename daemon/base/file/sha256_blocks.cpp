#include "daemon/base/file/sha256_blocks.hpp"

#include <bit>

#if defined(__x86_64__)
#include <cpuid.h>
#include <immintrin.h>
#endif

namespace weft::daemon {
namespace {

using Schedule = std::array<std::uint32_t, 64>;

std::uint32_t big_endian32(const std::uint8_t* p) {
  return std::uint32_t{p[0]} << 24 | std::uint32_t{p[1]} << 16 | std::uint32_t{p[2]} << 8 | p[3];
}

Schedule expand(const std::uint8_t* block) {
  Schedule w;
  for (std::size_t t = 0; t < 16; ++t) w[t] = big_endian32(block + 4 * t);
  for (std::size_t t = 16; t < 64; ++t) {
    const std::uint32_t s0 = std::rotr(w[t - 15], 7) ^ std::rotr(w[t - 15], 18) ^ (w[t - 15] >> 3);
    const std::uint32_t s1 = std::rotr(w[t - 2], 17) ^ std::rotr(w[t - 2], 19) ^ (w[t - 2] >> 10);
    w[t] = w[t - 16] + s0 + w[t - 7] + s1;
  }
  return w;
}

/// FIPS 180-4, section 6.2.2, with the names of that section.
void fold(Sha256State& state, const std::uint8_t* block) {
  const Schedule w = expand(block);
  auto [a, b, c, d, e, f, g, h] = state;
  for (std::size_t t = 0; t < 64; ++t) {
    const std::uint32_t sum1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
    const std::uint32_t t1 = h + sum1 + ((e & f) ^ (~e & g)) + sha256_round_constants[t] + w[t];
    const std::uint32_t sum0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
    const std::uint32_t t2 = sum0 + ((a & b) ^ (a & c) ^ (b & c));
    h = g;
    g = f;
    f = e;
    e = d + t1;
    d = c;
    c = b;
    b = a;
    a = t1 + t2;
  }
  const Sha256State sum{a, b, c, d, e, f, g, h};
  for (std::size_t i = 0; i < sum.size(); ++i) state[i] += sum[i];
}

}  // namespace

void sha256_compress_portable(Sha256State& state, const std::uint8_t* blocks, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) fold(state, blocks + 64 * i);
}

#if defined(__x86_64__)
namespace {

#define WEFT_SHA_TARGET __attribute__((target("sha,sse4.1,ssse3")))

/// Four 32-bit sums. The compiler's own vectors, for which clang-tidy knows no "portable"
/// substitute.
__m128i add32(__m128i a, __m128i b) {
  return reinterpret_cast<__m128i>(reinterpret_cast<__v4su>(a) + reinterpret_cast<__v4su>(b));
}

/// Sixteen groups of four rounds on one block. The instructions want the state as ABEF and CDGH
/// (Intel 64 Software Developer's Manual, volume 2, SHA256RNDS2).
WEFT_SHA_TARGET void fold_x86(__m128i& abef, __m128i& cdgh, const std::uint8_t* block) {
  const __m128i to_big_endian = _mm_set_epi64x(0x0c0d0e0f08090a0b, 0x0405060700010203);
  __m128i
      w[16];  // not std::array: a vector type loses its alignment attribute as a template argument
  for (std::size_t g = 0; g < 16; ++g) {
    if (g < 4) {
      const auto* words = reinterpret_cast<const __m128i*>(block + 16 * g);
      w[g] = _mm_shuffle_epi8(_mm_loadu_si128(words), to_big_endian);
    } else {
      const __m128i older = _mm_sha256msg1_epu32(w[g - 4], w[g - 3]);
      const __m128i middle = _mm_alignr_epi8(w[g - 1], w[g - 2], 4);
      w[g] = _mm_sha256msg2_epu32(add32(older, middle), w[g - 1]);
    }
    const auto* constants = reinterpret_cast<const __m128i*>(&sha256_round_constants[4 * g]);
    const __m128i sum = add32(w[g], _mm_loadu_si128(constants));
    cdgh = _mm_sha256rnds2_epu32(cdgh, abef, sum);
    abef = _mm_sha256rnds2_epu32(abef, cdgh, _mm_shuffle_epi32(sum, 0x0E));
  }
}

WEFT_SHA_TARGET void compress_x86(Sha256State& state, const std::uint8_t* blocks,
                                  std::size_t count) {
  auto* low = reinterpret_cast<__m128i*>(state.data());
  auto* high = reinterpret_cast<__m128i*>(state.data() + 4);
  const __m128i cdab = _mm_shuffle_epi32(_mm_loadu_si128(low), 0xB1);
  const __m128i efgh = _mm_shuffle_epi32(_mm_loadu_si128(high), 0x1B);
  __m128i abef = _mm_alignr_epi8(cdab, efgh, 8);
  __m128i cdgh = _mm_blend_epi16(efgh, cdab, 0xF0);
  for (std::size_t i = 0; i < count; ++i) {
    const __m128i abef_before = abef;
    const __m128i cdgh_before = cdgh;
    fold_x86(abef, cdgh, blocks + 64 * i);
    abef = add32(abef, abef_before);
    cdgh = add32(cdgh, cdgh_before);
  }
  const __m128i feba = _mm_shuffle_epi32(abef, 0x1B);
  const __m128i dchg = _mm_shuffle_epi32(cdgh, 0xB1);
  _mm_storeu_si128(low, _mm_blend_epi16(feba, dchg, 0xF0));
  _mm_storeu_si128(high, _mm_alignr_epi8(dchg, feba, 8));
}

bool processor_has_sha() {
  unsigned a = 0;
  unsigned b = 0;
  unsigned c = 0;
  unsigned d = 0;
  if (__get_cpuid(1, &a, &b, &c, &d) == 0 || (c & bit_SSE4_1) == 0) return false;
  return __get_cpuid_count(7, 0, &a, &b, &c, &d) != 0 && (b & bit_SHA) != 0;
}

}  // namespace

Sha256Compress sha256_compress_accelerated() {
  return processor_has_sha() ? compress_x86 : nullptr;
}
#else
Sha256Compress sha256_compress_accelerated() {
  return nullptr;
}
#endif

}  // namespace weft::daemon
