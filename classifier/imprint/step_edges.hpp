#pragma once
// Step edges after Canny, as in Ellis 1986 (section 3.3): ridges of the gradient across its own
// direction, selected by two thresholds in units of the image's noise.

#include <cstdint>
#include <span>
#include <vector>

#include "classifier/imprint/image.hpp"

namespace weft::classifier::imprint {

// Gradient of a smoothed imprint, and its noise estimated from third differences.

/// Central differences in counts per taxel, with the edge's value replicated: x to the right along
/// a row, y downwards, and their length.
struct Gradient {
  Image x, y, strength;
};

/// `out` gets the size of `image`.
void gradient(const Image& image, Gradient& out);

/// Conversion of the third differences to a noise (choice E2).
enum class NoiseForm {
  /// Counts per taxel: the deviation that white noise with these third differences, smoothed like
  /// the image, has in a component of the gradient.
  gradient,
  /// As worded in the paper: the root of the mean square itself, counts per taxel^3.
  literal
};
inline constexpr std::array<std::string_view, 2> noise_names{"gradient", "literal"};

/// Estimates the noise from the third differences (1, -3, 3, -1) along rows and columns of
/// `smoothed`. `weights` are those of its GaussianFilter. Lines shorter than four taxels have no
/// third differences; the result is 0 if there are none at all.
double noise_estimate(const Image& smoothed, std::span<const double> weights, NoiseForm form);

/// Thresholds in units of the noise estimate (Ellis 1986, section 3.3).
struct EdgeThresholds {
  double low = 1.2;
  double high = 1.8;
};

/// Refuses thresholds that are not 0 <= low <= high <= 1e6.
Status check(const EdgeThresholds& thresholds);

/// One taxel of an edge. Its orientation is that of the gradient, across the edge.
struct EdgeTaxel {
  std::uint32_t row = 0, col = 0;
  double x = 0, y = 0, strength = 0;  ///< of the gradient, counts per taxel
};

/// Finds the edges of gradients of any size. Keeps its scratch memory: one object per thread.
class StepEdges {
 public:
  /// Finds the edges, in row order. A taxel is a candidate if its gradient is larger than that of
  /// the neighbour ahead and not smaller than that of the one behind. Both are interpolated on the
  /// ring of eight (choice E8: a ridge of two equal taxels gives one). Border taxels are never
  /// candidates. The result has the 8-connected groups of candidates of at least low x noise with
  /// at least one of high x noise.
  ///
  /// If the noise is only rounding, at most 1e-12 of `largest` (the largest absolute value of the
  /// smoothed image), both thresholds are 1e-9 of `largest`, so that rounding makes no edge.
  const std::vector<EdgeTaxel>& find(const Gradient& gradient, double noise, double largest,
                                     const EdgeThresholds& thresholds);

 private:
  std::vector<std::uint8_t> state_;
  std::vector<std::size_t> open_;
  std::vector<EdgeTaxel> edges_;
};

}  // namespace weft::classifier::imprint
