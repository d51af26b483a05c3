#include "sim/devices/force_emulator.hpp"

namespace weft::sim {

double ForceEmulator::fz_off_n(TimePoint at) {
  double off_n = 0;
  if (const Fault* drift = active_fault(FaultKind::drift, at))
    off_n += drift->amount * to_seconds(at - drift->from);
  if (const Fault* jump = active_fault(FaultKind::bias_jump, at)) off_n += jump->amount;
  if (const Fault* noise = firing_fault(FaultKind::noise, at))
    off_n += noise->amount * fault_dice().gaussian();
  return off_n;
}

void ForceEmulator::hold_if_stuck(FtReading& reading, TimePoint at) {
  if (active_fault(FaultKind::stuck_force, at) == nullptr)
    stuck_.reset();
  else if (!stuck_)
    stuck_ = reading;
  if (stuck_) reading = *stuck_;
}

double ForceEmulator::calibration_factor(TimePoint at) const {
  const Fault* changed = active_fault(FaultKind::calibration_change, at);
  return changed == nullptr ? 1 : changed->amount;
}

}  // namespace weft::sim
