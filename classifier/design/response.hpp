#pragma once
// Response of a taxel array to a stroke: texture signal against noise, and the share of saturated
// values. docs/explanation/campaign-design.md, "Response".

#include "classifier/features/trial.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::design {

/// Textures that count, by the length of one period.
struct TextureBand {
  double shortest_m = 0.2e-3;  ///< a fine weave
  double longest_m = 5e-3;     ///< a coarse rib
};

struct Response {
  /// Mean over the taxels of the power of phase M in the band of textures [counts^2].
  double signal_counts2 = 0;
  /// Power that white noise of the variance seen in phase P would have in the same band.
  double noise_counts2 = 0;
  double snr_db = 0;  ///< 10 log10 of their ratio
  /// Share of the values of phase M at an end of the range.
  double saturated_share = 0;
  double low_hz = 0, high_hz = 0;  ///< the band: speed / period, up to half the sample rate
};

/// Response of one trial that slides at `speed_mps` and is sampled at `rate_hz`. A value `<=
/// lowest` or `>= highest` counts as saturated. Noise: half the mean square of successive
/// differences in phase P (von Neumann 1941), assumed white. Slow creep does not affect it. It is
/// at least the 1/12 count^2 of rounding to counts. Signal: the periodogram of phase M after its
/// straight line is subtracted. Refuses a trial with fewer than 3 samples in P or 8 in M, and a
/// band without a bin.
Result<Response> response_of(const Trial& trial, double rate_hz, double speed_mps, double lowest,
                             double highest, const TextureBand& band = {});

}  // namespace weft::classifier::design
