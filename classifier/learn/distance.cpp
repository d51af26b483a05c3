#include "classifier/learn/distance.hpp"

#include <algorithm>
#include <vector>

#include "classifier/base/lanes.hpp"
#include "classifier/learn/block.hpp"

namespace weft::classifier {
namespace {

using simd::Lanes;

// Columns from <= k < to of the first n rows of b as rows of `width` values, the padding zero.
void transpose(const Matrix& b, std::size_t from, std::size_t to, std::size_t n, std::size_t width,
               std::vector<double>& out) {
  out.assign((to - from) * width, 0.0);
  for (std::size_t j = 0; j < n; ++j) {
    const double* row = b.row(j).data();
    for (std::size_t k = from; k < to; ++k) out[(k - from) * width + j] = row[k];
  }
}

// Eight distances at a time stay in registers while the columns go by, in their order.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void add_row(const double* row, const double* columns, std::size_t count, std::size_t width,
             double* sums) {
  for (std::size_t j = 0; j < width; j += simd::width) {
    Lanes sum = simd::load(sums + j);
    for (std::size_t k = 0; k < count; ++k) {
      const Lanes d = row[k] - simd::load(columns + k * width + j);
      sum += d * d;
    }
    simd::store(sums + j, sum);
  }
}

}  // namespace

void add_squared_distances(const Matrix& a, const Matrix& b, std::size_t from, std::size_t to,
                           Matrix& squared) {
  const std::size_t n = squared.cols();
  const std::size_t width = (n + simd::width - 1) / simd::width * simd::width;
  std::vector<double> columns, sums(width);
  transpose(b, from, to, n, width, columns);
  for (std::size_t i = 0; i < a.rows(); ++i) {
    const auto out = squared.row(i);
    std::copy(out.begin(), out.end(), sums.begin());
    add_row(a.row(i).data() + from, columns.data(), to - from, width, sums.data());
    std::copy_n(sums.begin(), n, out.begin());
  }
}

void rbf(const Matrix& squared, double gamma, Matrix& out) {
  out = squared;
  exp_of_negative(out.data(), gamma);
}

Matrix rbf(const Matrix& squared, double gamma) {
  Matrix out;
  rbf(squared, gamma, out);
  return out;
}

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
