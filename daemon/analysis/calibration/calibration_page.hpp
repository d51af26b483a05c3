#pragma once
// The page of a calibration: pictures and tables that compare recordings with the simulation.

#include <string>

#include "daemon/analysis/calibration/calibrate.hpp"
#include "daemon/analysis/calibration/write_fabrics.hpp"
#include "daemon/pages/document/document.hpp"

namespace weft::daemon::calibration {

Document calibration_document(const CalibrationResult& result, const CalibrationSource& source);

}  // namespace weft::daemon::calibration
