#pragma once
// With which forces the plant presses, so that its pads read what was recorded. The gain of the
// recorded sensor is not the plant's: levels decide the forces, and of a wrench only the ratio of
// the load at rest to the force of a stroke is taken.

#include <span>
#include <vector>

#include "daemon/analysis/calibration/recording_view.hpp"
#include "sim/plant/pads.hpp"

namespace weft::daemon::calibration {

/// Counts above idle under even pressure, mean of the plant's pads without their spreads: closed
/// form.
double counts_under(const sim::PadParams& pads, double pressure_pa);
/// Its inverse; the pressure is at most that of 99.9 % of the counts of a closed pad.
double pressure_for(const sim::PadParams& pads, double counts);

/// Load in phase S over the force of the stroke, 0 to 0.9; 0 where a wrench recorded not both.
double rest_ratio(const Stroke& stroke);
/// Counts of the recorded sensor per count of the plant's, at least 1: above, where the plant's
/// pads cannot read the largest level.
double count_scale(const RecordingView& view, const sim::PadParams& pads);

/// Forces of one mounting.
struct Press {
  double rest_n = 0;            ///< > 0
  std::vector<double> force_n;  ///< of each stroke, at least rest_n
};
/// At force_n[k] the pads read the level of strokes[k] more than at rest: exactly, where all of
/// them have the same ratio and level; the load at rest is one for all. A level that no force
/// gives: that of the largest difference.
Press plan_press(std::span<const Stroke* const> strokes, const sim::PadParams& pads, double scale);

}  // namespace weft::daemon::calibration
