#include "classifier/learn/exponential.hpp"

#include <algorithm>

#include "classifier/learn/exponential_block.hpp"

namespace weft::classifier {

WEFT_CLONES("arch=x86-64-v4", "avx2")
void exp_of_negative(std::span<double> values, double factor) {
  const std::size_t whole = values.size() / simd::width * simd::width;
  for (std::size_t i = 0; i < whole; i += simd::width)
    simd::store(&values[i], exp_block(simd::load(&values[i]) * -factor));
  if (whole == values.size()) return;
  double rest[simd::width] = {};
  std::copy(values.begin() + static_cast<std::ptrdiff_t>(whole), values.end(), rest);
  simd::store(rest, exp_block(simd::load(rest) * -factor));
  std::copy_n(rest, values.size() - whole, values.begin() + static_cast<std::ptrdiff_t>(whole));
}

}  // namespace weft::classifier
