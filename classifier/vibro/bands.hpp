#pragma once
// Power in bands of frequency. Not of the paper: ours, for recordings of which its figures do not
// tell enough.

#include <array>
#include <cstddef>
#include <vector>

namespace weft::classifier::vibro {

inline constexpr std::size_t band_count = 16;
/// Of every band the mean over the frames of its power in dB, then of every band the deviation.
using BandFeatures = std::array<double, 2 * band_count>;

/// First bin of every band and one behind the last: from bin 2 on, each as much wider than the one
/// below as makes sixteen of them, at least one bin wide. Bands beyond the last bin are empty.
std::array<std::size_t, band_count + 1> band_edges(std::size_t bins);

/// Adds the frames of a window up, sixteen at a time.
class BandSums {
 public:
  explicit BandSums(std::size_t bins) : edges_(band_edges(bins)) {}
  /// `magnitudes` [bins x 16], of which the first `frames` are frames.
  void add(const double* magnitudes, std::size_t frames);
  /// At least one frame was added. An empty band stands at the least power, -100 dB.
  [[nodiscard]] BandFeatures figures() const;

 private:
  std::array<std::size_t, band_count + 1> edges_;
  std::array<std::vector<double>, band_count> level_db_;  // per frame
};

}  // namespace weft::classifier::vibro
