#pragma once
// Step edges after Canny, as Ellis 1986 (section 3.3) uses them: ridges of the gradient across its
// own direction, kept by two thresholds in units of the image's noise.

#include <cstdint>
#include <span>
#include <vector>

#include "classifier/imprint/image.hpp"

namespace weft::classifier::imprint {

// Gradient of a smoothed imprint, and the noise that its third differences tell of.

/// Central differences in counts per taxel, the edge's value replicated: x to the right along a
/// row, y downwards, and their length.
struct Gradient {
  Image x, y, strength;
};

/// `out` takes the size of `image`.
void gradient(const Image& image, Gradient& out);

/// How the third differences become a noise (choice E2).
enum class NoiseForm {
  /// Converted to the deviation that white noise with these third differences, smoothed as the
  /// image was, has in a component of the gradient: counts per taxel.
  gradient,
  /// The paper's words: the root of the mean square itself, counts per taxel^3.
  literal
};
inline constexpr std::array<std::string_view, 2> noise_names{"gradient", "literal"};

/// From the third differences (1, -3, 3, -1) along rows and columns of `smoothed`; `weights` are
/// those of the GaussianFilter that smoothed it. Lines shorter than four taxels have none; 0 where
/// there is none at all.
double noise_estimate(const Image& smoothed, std::span<const double> weights, NoiseForm form);

/// In units of the noise estimate (Ellis 1986, section 3.3).
struct EdgeThresholds {
  double low = 1.2;
  double high = 1.8;
};

/// Refuses thresholds that are not 0 <= low <= high <= 1e6.
Status check(const EdgeThresholds& thresholds);

/// One taxel of an edge. Orientation is that of the gradient, across the edge.
struct EdgeTaxel {
  std::uint32_t row = 0, col = 0;
  double x = 0, y = 0, strength = 0;  ///< of the gradient, counts per taxel
};

/// Finds the edges of gradients of any size. Keeps its scratch memory: one object per thread.
class StepEdges {
 public:
  /// A taxel is a candidate where its gradient is larger than the neighbour's ahead and not smaller
  /// than the one behind, both interpolated on the ring of eight (choice E8: a ridge of two equal
  /// taxels gives one); border taxels never are. Kept are the 8-connected groups of candidates of
  /// at least low x noise with at least one of high x noise. In row order.
  ///
  /// Where the noise is nothing but rounding, which is at most 1e-12 of `largest` (the largest
  /// absolute value of the smoothed image), both thresholds are 1e-9 of that, so that
  /// rounding makes no edge.
  const std::vector<EdgeTaxel>& find(const Gradient& gradient, double noise, double largest,
                                     const EdgeThresholds& thresholds);

 private:
  std::vector<std::uint8_t> state_;
  std::vector<std::size_t> open_;
  std::vector<EdgeTaxel> edges_;
};

}  // namespace weft::classifier::imprint
