#pragma once
// Forces with which the plant presses so that its pads give the recorded counts. The gain of the
// recorded sensor differs from the plant's, so the levels determine the forces. From a wrench only
// the ratio of the resting load to the stroke's force is used.

#include <span>
#include <vector>

#include "daemon/analysis/calibration/recording_view.hpp"
#include "sim/plant/pads.hpp"

namespace weft::daemon::calibration {

/// Counts above idle under even pressure, averaged over the plant's pads without their spreads, in
/// closed form.
double counts_under(const sim::PadParams& pads, double pressure_pa);
/// Inverse of counts_under(). The pressure is at most that for 99.9 % of the counts of a closed
/// pad.
double pressure_for(const sim::PadParams& pads, double counts);

/// Load in phase S divided by the force of the stroke, 0 to 0.9; 0 unless a wrench recorded both.
double rest_ratio(const Stroke& stroke);
/// Counts of the recorded sensor per count of the plant's, at least 1. Above 1 if the plant's pads
/// cannot reach the largest level.
double count_scale(const RecordingView& view, const sim::PadParams& pads);

/// Forces of one mounting.
struct Press {
  double rest_n = 0;            ///< > 0
  std::vector<double> force_n;  ///< per stroke, at least rest_n
};
/// At force_n[k] the pads read the level of strokes[k] above their reading at rest. This is exact
/// if all strokes have the same ratio and level, because the resting load is common to all. For a
/// level that no force reaches, the force with the largest difference.
Press plan_press(std::span<const Stroke* const> strokes, const sim::PadParams& pads, double scale);

}  // namespace weft::daemon::calibration
