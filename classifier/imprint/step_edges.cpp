#include "classifier/imprint/step_edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "classifier/base/lanes.hpp"

namespace weft::classifier::imprint {
namespace {

enum State : std::uint8_t { nothing, candidate, retained };

constexpr double rounding = 1e-12;       // share of the amplitude; up to it there is no noise
constexpr double flat_threshold = 1e-9;  // share of the amplitude; threshold if there is no noise

// True if the taxel at `at` is a ridge across the gradient (x, y); `cols` is the distance of rows.
bool is_ridge(const double* strength, std::ptrdiff_t at, std::ptrdiff_t cols, double x, double y) {
  const double across = std::abs(x), down = std::abs(y);
  const std::ptrdiff_t step_x = x > 0 ? 1 : -1, step_y = y > 0 ? cols : -cols;
  const bool flat = across >= down;
  const double share = flat ? down / across : across / down;
  const std::ptrdiff_t straight = flat ? step_x : step_y, corner = step_x + step_y;
  const double ahead = (1 - share) * strength[at + straight] + share * strength[at + corner];
  const double behind = (1 - share) * strength[at - straight] + share * strength[at - corner];
  return strength[at] > ahead && strength[at] >= behind;
}

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

// Adds the squared third differences of four lines. `sum` has one sum per column, so the order of
// lanes does not matter.
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

Status check(const EdgeThresholds& thresholds) {
  if (thresholds.low >= 0.0 && thresholds.low <= thresholds.high && thresholds.high <= 1e6)
    return {};
  return fail({.code = Errc::range,
               .where = "thresholds",
               .what = "edge thresholds out of range",
               .expected = "0 <= low <= high <= 1e6",
               .got = std::to_string(thresholds.low) + ", " + std::to_string(thresholds.high)});
}

const std::vector<EdgeTaxel>& StepEdges::find(const Gradient& gradient, double noise,
                                              double largest, const EdgeThresholds& thresholds) {
  const std::size_t rows = gradient.strength.rows(), cols = gradient.strength.cols();
  const double* const strength = gradient.strength.data().data();
  const double* const along_x = gradient.x.data().data();
  const double* const along_y = gradient.y.data().data();
  const bool silent = noise <= rounding * largest;
  const double low = silent ? flat_threshold * largest : thresholds.low * noise;
  const double high = silent ? low : thresholds.high * noise;
  edges_.clear();
  if (rows < 3 || cols < 3) return edges_;
  state_.assign(rows * cols, nothing);
  const auto stride = static_cast<std::ptrdiff_t>(cols);
  for (std::size_t r = 1; r + 1 < rows; ++r)
    for (std::size_t i = r * cols + 1; i < (r + 1) * cols - 1; ++i) {
      if (!(strength[i] > 0.0) || strength[i] < low) continue;
      if (!is_ridge(strength, static_cast<std::ptrdiff_t>(i), stride, along_x[i], along_y[i]))
        continue;
      const bool strong = strength[i] >= high;
      state_[i] = strong ? retained : candidate;
      if (strong) open_.push_back(i);
    }
  while (!open_.empty()) {  // candidates are never on the border, so every neighbour exists
    const std::size_t i = open_.back();
    open_.pop_back();
    for (const std::size_t line : {i - cols, i, i + cols})
      for (const std::size_t near : {line - 1, line, line + 1}) {
        if (state_[near] != candidate) continue;
        state_[near] = retained;
        open_.push_back(near);
      }
  }
  for (std::size_t i = 0; i < state_.size(); ++i)
    if (state_[i] == retained)
      edges_.push_back({static_cast<std::uint32_t>(i / cols), static_cast<std::uint32_t>(i % cols),
                        along_x[i], along_y[i], strength[i]});
  return edges_;
}

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
