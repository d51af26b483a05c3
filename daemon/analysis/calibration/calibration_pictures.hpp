#pragma once
// Pictures of a calibration: recorded beside SIMULATED before and after, told apart by shape and
// colour.

#include <string>
#include <string_view>

#include "daemon/analysis/calibration/calibrate.hpp"

namespace weft::daemon::calibration {

/// <figure> elements, each with the badge in its caption. A picture without any recorded value is
/// left out.
std::string calibration_pictures(const CalibrationResult& result, std::string_view badge_html);

}  // namespace weft::daemon::calibration
