#pragma once
// Does the calibrated plant make strokes like those that it was not fitted to?

#include "daemon/analysis/calibration/calibrate.hpp"

namespace weft::daemon::calibration {

/// Compares all statistics of a choice of the held-out strokes with the same choice simulated
/// `held_out_replicates` times: mean +- t sd sqrt(1 + 1/n), which is where one more replicate lies
/// in 95 % of the cases. A statistic that fewer than half of the replicates have is not inside.
/// Errors: the scene's.
Result<HeldOutCheck> check_held_out(const RecordingView& held_out, const ClothModel& model,
                                    std::span<const double> values,
                                    const CalibrationOptions& options);

}  // namespace weft::daemon::calibration
