#pragma once
// Checks whether the calibrated plant reproduces strokes to which it was not fitted.

#include "daemon/analysis/calibration/calibrate.hpp"

namespace weft::daemon::calibration {

/// Compares all statistics of selected held-out strokes with the same selection simulated
/// `held_out_replicates` times. The interval is mean +- t sd sqrt(1 + 1/n), which contains one more
/// replicate in 95 % of the cases. A statistic that fewer than half of the replicates have counts
/// as outside. Errors: the scene's.
Result<HeldOutCheck> check_held_out(const RecordingView& held_out, const ClothModel& model,
                                    std::span<const double> values,
                                    const CalibrationOptions& options);

}  // namespace weft::daemon::calibration
