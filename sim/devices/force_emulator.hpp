#pragma once
// What befalls the reading of a force sensor, whatever wire it is sent on.

#include <optional>

#include "sim/devices/emulator.hpp"
#include "sim/devices/ft_sensor.hpp"

namespace weft::sim {

class ForceEmulator : public Emulator {
 protected:
  /// Drift, a jump of the bias and noise on Fz [N], as the gauges have it: a bias takes it off.
  double fz_off_n(TimePoint at);
  /// The values stay what they were when the fault began.
  void hold_if_stuck(FtReading& reading, TimePoint at);
  /// What the counts are multiplied by; 1 without a fault.
  [[nodiscard]] double calibration_factor(TimePoint at) const;

 private:
  std::optional<FtReading> stuck_;
};

}  // namespace weft::sim
