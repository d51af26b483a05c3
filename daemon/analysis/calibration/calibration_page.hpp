#pragma once
// The page of a calibration: pictures and tables of what was recorded beside what is simulated.

#include <string>

#include "daemon/analysis/calibration/calibrate.hpp"
#include "daemon/analysis/calibration/write_fabrics.hpp"

namespace weft::daemon::calibration {

/// One file without scripts or outside resources. All that is simulated says so.
std::string calibration_html(const CalibrationResult& result, const CalibrationSource& source);

}  // namespace weft::daemon::calibration
