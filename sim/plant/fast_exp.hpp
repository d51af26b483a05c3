#pragma once
// e^x in float without branches, so that loops over height fields vectorise. Relative error below
// 2e-7. Method: x = n ln 2 + f, polynomial in f (coefficients of Cephes expf, public domain),
// exponent n put in by bits.

#include <bit>
#include <cstddef>
#include <cstdint>

namespace weft::sim {

constexpr float fast_exp_limit = 87;  // e^87 and e^-87 are normal floats

/// e^x for |x| <= fast_exp_limit; nonsense beyond.
inline float fast_exp(float x) {
  constexpr float shifter = 12582912.0F;  // 1.5 * 2^23: adding it rounds to an integer
  const float shifted = x * 1.44269504F + shifter;
  const float n = shifted - shifter;
  const float f = (x - n * 0.693359375F) + n * 2.12194440e-4F;  // ln 2 in two parts
  float p = 1.9875691500e-4F;
  p = p * f + 1.3981999507e-3F;
  p = p * f + 8.3334519073e-3F;
  p = p * f + 4.1665795894e-2F;
  p = p * f + 1.6666665459e-1F;
  p = p * f + 5.0000001201e-1F;
  p = p * f * f + f + 1.0F;
  const std::uint32_t scale = (std::bit_cast<std::uint32_t>(shifted) + 127U) << 23;
  return p * std::bit_cast<float>(scale);
}

/// e^x in place, arguments held to the limit. Two loops: g++ 12 vectorises them only apart.
template <std::size_t count>
void fast_exp(float* x) {
  for (std::size_t i = 0; i < count; ++i) {
    const float above = x[i] > -fast_exp_limit ? x[i] : -fast_exp_limit;
    x[i] = above < fast_exp_limit ? above : fast_exp_limit;
  }
  for (std::size_t i = 0; i < count; ++i) x[i] = fast_exp(x[i]);
}

}  // namespace weft::sim
