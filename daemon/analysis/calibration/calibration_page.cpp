#include "daemon/analysis/calibration/calibration_page.hpp"

namespace weft::daemon::calibration {

std::string calibration_html(const CalibrationResult&, const CalibrationSource&) {
  return {};
}

}  // namespace weft::daemon::calibration
