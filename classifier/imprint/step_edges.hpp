#pragma once
// Step edges after Canny, as Ellis 1986 (section 3.3) uses them: ridges of the gradient across its
// own direction, kept by two thresholds in units of the image's noise.

#include <cstdint>
#include <vector>

#include "classifier/imprint/gradient.hpp"

namespace weft::classifier::imprint {

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
  /// absolute value of the smoothed image, at least 1), both thresholds are 1e-9 of that, so that
  /// rounding makes no edge.
  const std::vector<EdgeTaxel>& find(const Gradient& gradient, double noise, double largest,
                                     const EdgeThresholds& thresholds);

 private:
  std::vector<std::uint8_t> state_;
  std::vector<std::size_t> open_;
  std::vector<EdgeTaxel> edges_;
};

}  // namespace weft::classifier::imprint
