#include "classifier/imprint/step_edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "classifier/base/lanes.hpp"

namespace weft::classifier::imprint {
namespace {

constexpr std::array<double, 3> first_difference{0.5, 0.0, -0.5};
constexpr std::array<double, 4> third_difference{1.0, -3.0, 3.0, -1.0};

WEFT_CLONES("arch=x86-64-v4", "avx2")
void half_difference(const double* after, const double* before, std::size_t count, double* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = (after[i] - before[i]) / 2.0;
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void lengths(const double* x, const double* y, std::size_t count, double* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = std::sqrt(x[i] * x[i] + y[i] * y[i]);
}

// Sum of squared third differences of four lines; column sums are kept apart in `sum`, so that no
// order of lanes matters.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void add_squares(const double* a, const double* b, const double* c, const double* d,
                 std::size_t count, double* sum) {
  for (std::size_t i = 0; i < count; ++i) {
    const double third = d[i] - 3.0 * c[i] + 3.0 * b[i] - a[i];
    sum[i] += third * third;
  }
}

// Sum of squares of the whole kernel convolved with a difference.
template <std::size_t N>
double power(std::span<const double> weights, const std::array<double, N>& difference) {
  const std::size_t reach = weights.size() - 1, length = 2 * reach + 1;
  double sum = 0.0;
  for (std::size_t i = 0; i < length + N - 1; ++i) {
    double value = 0.0;
    for (std::size_t k = 0; k < N; ++k) {
      if (i < k || i - k >= length) continue;
      const std::size_t at = i - k;
      value += difference[k] * weights[at > reach ? at - reach : reach - at];
    }
    sum += value * value;
  }
  return sum;
}

}  // namespace

void gradient(const Image& image, Gradient& out) {
  const std::size_t rows = image.rows(), cols = image.cols();
  for (Image* part : {&out.x, &out.y, &out.strength}) part->assign(rows, cols);
  for (std::size_t r = 0; r < rows; ++r) {
    const double* const at = image.row(r).data();
    double* const x = out.x.row(r).data();
    if (cols > 1) {
      x[0] = (at[1] - at[0]) / 2.0;
      x[cols - 1] = (at[cols - 1] - at[cols - 2]) / 2.0;
      half_difference(at + 2, at, cols - 2, x + 1);
    }
    half_difference(image.row(std::min(r + 1, rows - 1)).data(),
                    image.row(r > 0 ? r - 1 : 0).data(), cols, out.y.row(r).data());
    lengths(x, out.y.row(r).data(), cols, out.strength.row(r).data());
  }
}

double noise_estimate(const Image& smoothed, std::span<const double> weights, NoiseForm form) {
  const std::size_t rows = smoothed.rows(), cols = smoothed.cols();
  std::vector<double> sum(cols, 0.0);
  std::size_t count = 0;
  if (cols > 3) {
    for (std::size_t r = 0; r < rows; ++r) {
      const double* const at = smoothed.row(r).data();
      add_squares(at, at + 1, at + 2, at + 3, cols - 3, sum.data());
    }
    count += rows * (cols - 3);
  }
  if (rows > 3) {
    for (std::size_t r = 0; r + 3 < rows; ++r)
      add_squares(smoothed.row(r).data(), smoothed.row(r + 1).data(), smoothed.row(r + 2).data(),
                  smoothed.row(r + 3).data(), cols, sum.data());
    count += (rows - 3) * cols;
  }
  if (count == 0) return 0.0;
  double total = 0.0;
  for (const double value : sum) total += value;
  const double root_mean_square = std::sqrt(total / static_cast<double>(count));
  if (form == NoiseForm::literal) return root_mean_square;
  return root_mean_square *
         std::sqrt(power(weights, first_difference) / power(weights, third_difference));
}

}  // namespace weft::classifier::imprint
