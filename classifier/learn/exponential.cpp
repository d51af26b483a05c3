#include "classifier/learn/exponential.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "classifier/learn/block.hpp"

namespace weft::classifier {
namespace {

// exp(r) for |r| <= ln(2) / 2: the series to r^13, whose next term is below 5e-18.
WEFT_INLINE Block series(Block r) {
  constexpr double inverse_factorial[] = {
      1.0 / 6227020800, 1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880, 1.0 / 40320,
      1.0 / 5040,       1.0 / 720,       1.0 / 120,      1.0 / 24,      1.0 / 6,      0.5};
  Block sum = all(inverse_factorial[0]);
  for (int k = 1; k < 12; ++k) sum = sum * r + inverse_factorial[k];
  return (sum * r * r + r) + 1.0;
}

// x <= 0. k = round(x / ln 2) comes out of the low bits of x / ln 2 + 1.5 2^52.
WEFT_INLINE Block exp_block(Block x) {
  constexpr double shifter = 0x1.8p52;
  constexpr double ln2_high = 0x1.62e42feep-1;  // 32 bits, so that k ln2_high is exact
  constexpr double ln2_low = 0x1.a39ef35793c76p-33;
  const Block least = all(-707.0);
  const Block bounded = x < least ? least : x;
  const Block shifted = bounded * 0x1.71547652b82fep0 + shifter;
  const Block k = shifted - shifter;
  const Block r = (bounded - k * ln2_high) - k * ln2_low;
  const auto exponent = (std::bit_cast<BlockBits>(shifted) + 1023) << 52;
  const Block value = series(r) * std::bit_cast<Block>(exponent);
  return x < least ? all(0.0) : value;
}

}  // namespace

WEFT_CLONES("avx2") void exp_of_negative(std::span<double> values, double factor) {
  const std::size_t whole = values.size() / lanes * lanes;
  const Block minus = all(-factor);
  for (std::size_t i = 0; i < whole; i += lanes)
    store(&values[i], exp_block(load(&values[i]) * minus));
  if (whole == values.size()) return;
  double rest[lanes] = {};
  std::copy(values.begin() + static_cast<std::ptrdiff_t>(whole), values.end(), rest);
  store(rest, exp_block(load(rest) * minus));
  std::copy_n(rest, values.size() - whole, values.begin() + static_cast<std::ptrdiff_t>(whole));
}

}  // namespace weft::classifier
