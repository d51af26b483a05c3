#pragma once
// Pictures of a calibration: recorded beside SIMULATED before and after, distinguished by shape and
// colour.

#include <string>
#include <string_view>
#include <vector>

#include "daemon/analysis/calibration/calibrate.hpp"
#include "daemon/pages/document/document.hpp"

namespace weft::daemon::calibration {

struct CalibrationPicture {
  std::string name;  ///< "modulation", "spectrum-Denim"; contains labels, so it is not always a
                     ///< valid file name
  chart::Plot plot;
  std::string caption;
};
/// A picture without a recorded value is left out.
std::vector<CalibrationPicture> draw_calibration(const CalibrationResult& result);

/// The pictures as figures, each with the badge in its caption.
Blocks calibration_pictures(const CalibrationResult& result, std::string_view badge_html);

}  // namespace weft::daemon::calibration
