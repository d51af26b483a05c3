#include "classifier/vibro/learn/product.hpp"

namespace weft::classifier::vibro {
namespace {

using Floats = float __attribute__((vector_size(column_step * sizeof(float))));
constexpr std::size_t rows_at_once = 6, vectors_at_once = 2;  // sums stay in registers

struct __attribute__((packed, may_alias)) Loose {
  Floats value;
};
WEFT_INLINE Floats load(const float* p) {
  return reinterpret_cast<const Loose*>(p)->value;
}

template <std::size_t R, std::size_t V>
WEFT_INLINE void tile(const float* a, std::size_t inner, std::size_t a_stride, const float* b,
                      std::size_t columns, float* out) {
  Floats sum[R][V] = {};
  for (std::size_t i = 0; i < inner; ++i, b += columns) {
    Floats row[V];
    for (std::size_t v = 0; v < V; ++v) row[v] = load(b + v * column_step);
    for (std::size_t r = 0; r < R; ++r) {
      const float factor = a[r * a_stride + i];
      for (std::size_t v = 0; v < V; ++v) sum[r][v] += row[v] * factor;
    }
  }
  for (std::size_t r = 0; r < R; ++r)
    for (std::size_t v = 0; v < V; ++v)
      reinterpret_cast<Loose*>(out + r * columns + v * column_step)->value = sum[r][v];
}

template <std::size_t R>
WEFT_INLINE void stripe(const float* a, std::size_t inner, std::size_t a_stride, const float* b,
                        std::size_t columns, float* out) {
  constexpr std::size_t wide = vectors_at_once * column_step;
  std::size_t c = 0;
  for (; c + wide <= columns; c += wide)
    tile<R, vectors_at_once>(a, inner, a_stride, b + c, columns, out + c);
  if (c < columns) tile<R, 1>(a, inner, a_stride, b + c, columns, out + c);
}

}  // namespace

WEFT_CLONES("arch=x86-64-v4", "avx2")
void product(const float* a, std::size_t rows, std::size_t inner, std::size_t a_stride,
             const float* b, std::size_t columns, float* out) {
  std::size_t r = 0;
  for (; r + rows_at_once <= rows; r += rows_at_once)
    stripe<rows_at_once>(a + r * a_stride, inner, a_stride, b, columns, out + r * columns);
  for (; r < rows; ++r) stripe<1>(a + r * a_stride, inner, a_stride, b, columns, out + r * columns);
}

}  // namespace weft::classifier::vibro
