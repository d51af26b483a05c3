#include "classifier/imprint/step_edges.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace weft::classifier::imprint {
namespace {

enum State : std::uint8_t { nothing, candidate, retained };

constexpr double rounding = 1e-12;       // of the amplitude: no noise at all
constexpr double flat_threshold = 1e-9;  // of the amplitude, where there is no noise

// Whether the taxel at `at` is a ridge across the gradient (x, y); `cols` apart are rows.
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

}  // namespace

Status check(const EdgeThresholds& thresholds) {
  if (thresholds.low >= 0.0 && thresholds.low <= thresholds.high && thresholds.high <= 1e6)
    return {};
  return fail({.code = Errc::range,
               .where = "thresholds",
               .what = "edges cannot be kept by these thresholds",
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
  while (!open_.empty()) {  // candidates are never on the border: every neighbour exists
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

}  // namespace weft::classifier::imprint
